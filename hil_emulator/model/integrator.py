"""Integration: classical Runge-Kutta steps, divided at impacts.

The memory of the integration is private: the compiler keeps it in registers, and omits unused
signals of a trial state.
"""

from typing import Any, NamedTuple

from hil_emulator.model.constants import ACTUATORS, PIECES, VELOCITY_DOUBT
from hil_emulator.model.exchange import balances, evaluate
from hil_emulator.model.sensors import observe
from hil_emulator.model.stages import spool_reach

STATE_LENGTH = 0
"""Length of a state; the module that `kernel` generates has its own value."""

ELEMENTS = 1
"""Number of sensing elements; without any, values between samples are not stored."""


class Work(NamedTuple):
    """Memory of an integration: state records of all actuators in each.

    Attributes:
        states: initial states; advanced in place.
        trial: states at which the balances are evaluated.
        slopes: the rates at `trial`; initially zero, and zero for effects that are off.
        mean: weighted sum of a step's four slopes.
        bend: sum of the slopes that is zero if they are linear in time.

    """

    states: Any
    trial: Any
    slopes: Any
    mean: Any
    bend: Any


def as_floats(records: Any) -> Any:
    """Stand in for the compiled function, see `array_memory`."""
    raise TypeError("'as_floats' runs only in the module that kernel.build makes")


def sum_slopes(
    work: Work, par: Any, held: Any, y: Any, path: Any, done: int, step: float
) -> None:  # fmt: skip
    """Sum the four slopes of a classical Runge-Kutta step.

    The first slope is that of the states; at this point the sensing elements receive the result of
    the last step.

    Args:
        work: memory of the integration, with the states.
        par: as of `integrate`.
        held: as of `integrate`.
        y: as of `integrate`.
        path: receives the quantities of the sensing elements.
        done: number of finished steps; 0 within a step, and in the first step of a call.
        step: width of this step [s].

    """
    state, trial, slope = as_floats(work.states), as_floats(work.trial), as_floats(work.slopes)
    mean, bend = as_floats(work.mean), as_floats(work.bend)
    for i in range(STATE_LENGTH * ACTUATORS):
        trial[i] = state[i]
        mean[i] = 0.0
        bend[i] = 0.0
    for stage in range(4):
        balances(work.trial, work.slopes, par, held, y)
        if stage == 0 and done > 0 and ELEMENTS > 0:
            observe(y, path[done - 1])
        outer = stage == 0 or stage == 3
        weight = 1.0 if outer else 2.0
        sign = 1.0 if outer else -1.0
        reach = step if stage == 2 else 0.5 * step
        for i in range(STATE_LENGTH * ACTUATORS):
            trial[i] = state[i] + reach * slope[i]
            mean[i] += weight * slope[i]
            bend[i] += sign * slope[i]


def advance(work: Work, step: float) -> None:
    """Move the states by the mean of the four slopes."""
    state, mean = as_floats(work.states), as_floats(work.mean)
    for i in range(STATE_LENGTH * ACTUATORS):
        state[i] += step / 6.0 * mean[i]


def arrest(x: Any, dx: Any, par: Any) -> None:
    """Stop each spool at its housing."""
    for i in range(ACTUATORS):
        reach = spool_reach(par[i], x[i], dx[i], x[i].spool_position)
        if reach != x[i].spool_position:
            x[i].spool_position = reach
            x[i].spool_speed = 0.0


def unsure(bends: Any, step: float) -> bool:
    """Return whether the curvature of an acceleration within a step indicates an impact.

    Impacts occur at an end stop, a wall, the flanks of a backlash, or for a light rod on a stiff
    load cell.
    """
    doubt = False
    for i in range(ACTUATORS):
        bend = max(abs(bends[i].velocity), abs(bends[i].stretch_speed))
        doubt = doubt or step * bend > VELOCITY_DOUBT
    return doubt


def integrate(
    work: Work, par: Any, held: Any, y: Any, path: Any, first: int, step: float, steps: int
) -> None:  # fmt: skip
    """Take `steps` steps of classical Runge-Kutta with the inputs held.

    A step with an impact is divided into pieces. The actuators of one supply take every stage of
    every step together, so the exchanged flows have the same order of accuracy as the states.

    Args:
        work: the states, and private memory of the integration.
        par: parameters of each actuator.
        held: inputs and values derived from parameters, constant over the call, of each actuator.
        y: signals of each actuator at the states reached.
        path: quantities of the sensing elements after each step, channels of all actuators in
            order, shape (steps, actuators * channels); overwritten, without elements only in the
            last row.
        first: row of `path` that the first step fills.
        step: step width [s].
        steps: number of steps.

    """
    done = 0
    pieces = 0
    while done < steps:
        width = step if pieces == 0 else step / PIECES
        row = first + done if pieces == 0 and done > 0 else 0
        sum_slopes(work, par, held, y, path, row, width)
        if pieces == 0 and unsure(work.bend, step):
            pieces = PIECES
            continue
        advance(work, width)
        arrest(work.states, work.slopes, par)
        if pieces > 0:
            pieces -= 1
        if pieces == 0:
            done += 1
    # the signals of a trial state are not those of the state reached
    evaluate(work.states, work.slopes, par, held, y)
    if steps > 0:
        observe(y, path[first + steps - 1])


def finite(memory: Any) -> bool:
    """Return whether all numbers are finite, by 0 times each: NaN for numbers that are not."""
    remainder = 0.0
    for i in range(STATE_LENGTH * ACTUATORS):
        remainder += 0.0 * memory[i]
    return remainder == 0.0


INTEGRATOR = (sum_slopes, advance, arrest, unsure, integrate, finite)
"""What `kernel` compiles of this file, in the order of use."""
