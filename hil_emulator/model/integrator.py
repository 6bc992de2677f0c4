"""One step in time: classical Runge-Kutta, divided where something hits."""

from typing import Any

from hil_emulator.model.constants import ACTUATORS, PIECES, VELOCITY_DOUBT
from hil_emulator.model.exchange import balances, evaluate
from hil_emulator.model.sensors import observe
from hil_emulator.model.stages import spool_reach

STATE_LENGTH = 0
"""How many numbers a state holds: the module that `kernel` makes of a model has its own value."""


def slopes(rows: Any, memory: Any, par: Any, held: Any, y: Any, step: float) -> None:
    """Fill the last three of the four slopes of a classical Runge-Kutta step: rows 3 to 5.

    Row 2 is the first, that of the states in row 0.
    """
    n = STATE_LENGTH * ACTUATORS
    trial = rows[ACTUATORS : 2 * ACTUATORS]
    for stage in range(3):
        reach = step if stage == 2 else 0.5 * step
        for i in range(n):
            memory[n + i] = memory[i] + reach * memory[(2 + stage) * n + i]
        balances(trial, rows[(3 + stage) * ACTUATORS : (4 + stage) * ACTUATORS], par, held, y)


def advance(memory: Any, step: float) -> None:
    """Move the states by the mean of the four slopes."""
    n = STATE_LENGTH * ACTUATORS
    for i in range(n):
        slope = memory[2 * n + i] + 2.0 * (memory[3 * n + i] + memory[4 * n + i])
        memory[i] += step / 6.0 * (slope + memory[5 * n + i])


def arrest(x: Any, dx: Any, par: Any) -> None:
    """Leave each spool at rest where its housing stops it."""
    for i in range(ACTUATORS):
        reach = spool_reach(par[i], x[i], dx[i], x[i].spool_position)
        if reach != x[i].spool_position:
            x[i].spool_position = reach
            x[i].spool_speed = 0.0


def bend(first: float, second: float, third: float, fourth: float) -> float:
    """Return how far four slopes of a step are from a straight line in time."""
    return abs((first - second) - (third - fourth))


def unsure(rows: Any, step: float) -> bool:
    """Tell whether an acceleration bends more within a step than a smooth motion lets it.

    It does where something hits: an end stop, a wall, the flanks of a backlash, a light rod on a
    stiff load cell.
    """
    doubt = False
    for i in range(ACTUATORS):
        k_1, k_2 = rows[2 * ACTUATORS + i], rows[3 * ACTUATORS + i]
        k_3, k_4 = rows[4 * ACTUATORS + i], rows[5 * ACTUATORS + i]
        rod = bend(k_1.velocity, k_2.velocity, k_3.velocity, k_4.velocity)
        stretch = bend(k_1.stretch_speed, k_2.stretch_speed, k_3.stretch_speed, k_4.stretch_speed)
        doubt = doubt or step * max(rod, stretch) > VELOCITY_DOUBT
    return doubt


def integrate(
    rows: Any, memory: Any, par: Any, held: Any, y: Any, path: Any, step: float, steps: int
) -> None:
    """Take `steps` steps of classical Runge-Kutta with the inputs held.

    A step in which something hits is taken in pieces instead. The actuators of one supply take
    every stage of every step together: what they exchange is as exact as everything else.

    Args:
        rows: state records of all actuators, one after the other, in each of six rows: states,
            trial states, four rates.
        memory: the same memory as float64, shape (6 * actuators * states,).
        par: parameters of each actuator.
        held: inputs and what follows from parameters, constant over the call, of each.
        y: signals of each; they belong to the states reached.
        path: what the sensors' elements meet after each step, channels of all actuators one after
            the other, shape (steps, actuators * channels); overwritten.
        step: step width [s].
        steps: number of steps.

    """
    states, rates = rows[:ACTUATORS], rows[2 * ACTUATORS : 3 * ACTUATORS]
    for i in range(steps):
        balances(states, rates, par, held, y)
        if i > 0:
            observe(y, path[i - 1])
        slopes(rows, memory, par, held, y, step)
        if not unsure(rows, step):
            advance(memory, step)
            arrest(states, rates, par)
            continue
        for _ in range(PIECES):
            balances(states, rates, par, held, y)
            slopes(rows, memory, par, held, y, step / PIECES)
            advance(memory, step / PIECES)
            arrest(states, rates, par)
    # the signals of a trial state are not those of the state reached
    evaluate(states, rates, par, held, y)
    if steps > 0:
        observe(y, path[steps - 1])


def finite(memory: Any) -> bool:
    """Tell whether every number of the states is finite: zero times any other is NaN."""
    remainder = 0.0
    for i in range(STATE_LENGTH * ACTUATORS):
        remainder += 0.0 * memory[i]
    return remainder == 0.0


INTEGRATOR = (slopes, advance, arrest, bend, unsure, integrate, finite)
"""What `kernel` compiles of this file, in the order of use."""
