"""One step in time: classical Runge-Kutta, divided where something hits."""

from typing import Any

from hil_emulator.model.actuator import balance, derivative
from hil_emulator.model.constants import PIECES, VELOCITY_DOUBT

STATE_LENGTH = 0
"""How many numbers a state holds: the module that `kernel` makes of a model has its own value."""


def slopes(rows: Any, memory: Any, par: Any, held: Any, y: Any, step: float) -> None:
    """Fill the four slopes of a classical Runge-Kutta step from rows[0]: rows[2] to rows[5]."""
    n = STATE_LENGTH
    balance(rows[0], rows[2], par, held, y)
    for stage in range(3):
        reach = step if stage == 2 else 0.5 * step
        for i in range(n):
            memory[n + i] = memory[i] + reach * memory[(2 + stage) * n + i]
        balance(rows[1], rows[3 + stage], par, held, y)


def advance(memory: Any, step: float) -> None:
    """Move the state by the mean of the four slopes."""
    n = STATE_LENGTH
    for i in range(n):
        slope = memory[2 * n + i] + 2.0 * (memory[3 * n + i] + memory[4 * n + i])
        memory[i] += step / 6.0 * (slope + memory[5 * n + i])


def bend(first: float, second: float, third: float, fourth: float) -> float:
    """Return how far four slopes of a step are from a straight line in time."""
    return abs((first - second) - (third - fourth))


def unsure(rows: Any, step: float) -> bool:
    """Tell whether the acceleration bends more within a step than a smooth motion lets it.

    It does where something hits: an end stop, a wall, the flanks of a backlash, a light rod on a
    stiff load cell.
    """
    k_1, k_2, k_3, k_4 = rows[2], rows[3], rows[4], rows[5]
    rod = bend(k_1.velocity, k_2.velocity, k_3.velocity, k_4.velocity)
    stretch = bend(k_1.stretch_speed, k_2.stretch_speed, k_3.stretch_speed, k_4.stretch_speed)
    doubt: bool = step * max(rod, stretch) > VELOCITY_DOUBT
    return doubt


def integrate(rows: Any, memory: Any, par: Any, held: Any, y: Any, step: float, steps: int) -> None:
    """Take `steps` steps of classical Runge-Kutta with the inputs held.

    A step in which something hits is taken in pieces instead.

    Args:
        rows: six state records: the state, a trial state, four rates.
        memory: the same memory as float64, shape (6 * states,).
        par: parameters.
        held: inputs and what follows from parameters, constant over the call.
        y: signals; they belong to the state reached.
        step: step width [s].
        steps: number of steps.

    """
    for _ in range(steps):
        slopes(rows, memory, par, held, y, step)
        if not unsure(rows, step):
            advance(memory, step)
            continue
        for _ in range(PIECES):
            slopes(rows, memory, par, held, y, step / PIECES)
            advance(memory, step / PIECES)
    # the signals of a trial state are not those of the state reached
    derivative(rows[0], rows[2], par, held, y)


def finite(memory: Any) -> bool:
    """Tell whether every number of the state is finite: zero times any other is NaN."""
    remainder = 0.0
    for i in range(STATE_LENGTH):
        remainder += 0.0 * memory[i]
    return remainder == 0.0


INTEGRATOR = (slopes, advance, bend, unsure, integrate, finite)
"""What `kernel` compiles of this file, in the order of use."""
