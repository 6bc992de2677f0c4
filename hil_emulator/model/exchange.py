"""Actuators on one supply: each moves by itself, then the supply delivers the sum of their flows.

If the load of one actuator carries the next load, both are the joints of a leg, see `leg`.

Every actuator has the equations and states of pump, accumulator and lines. Actuators on one supply
have equal parameters of the supply and the same flows, so their copies of its states agree to the
last bit. For a single actuator the sum is its flow.
"""

from typing import Any

from hil_emulator.model.actuator import move, power_signals, supply_balance
from hil_emulator.model.constants import ACTUATORS
from hil_emulator.model.leg import swing
from hil_emulator.model.stages import joint_carries


def balances(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Evaluate the balances of all actuators on a supply; arguments as in `actuator`, of each."""
    drawn = 0.0
    returned = 0.0
    for i in range(ACTUATORS):
        move(x[i], dx[i], par[i], held[i], y[i])
        drawn += y[i].supply_flow
        returned += y[i].tank_flow
    for i in range(ACTUATORS - 1):
        if joint_carries(par[i], x[i], dx[i]) != 0.0:
            swing(x[i], dx[i], par[i], y[i], x[i + 1], dx[i + 1], par[i + 1], y[i + 1])
    for i in range(ACTUATORS):
        supply_balance(x[i], dx[i], par[i], held[i], y[i], drawn, returned)


def evaluate(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Evaluate every balance and every signal of all actuators on a supply."""
    balances(x, dx, par, held, y)
    for i in range(ACTUATORS):
        power_signals(x[i], par[i], held[i], y[i])


EXCHANGE = (balances, evaluate)
"""What `kernel` compiles of this file, in the order of use."""
