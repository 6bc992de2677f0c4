"""Steps in time: classical Runge-Kutta, divided where something hits.

Everything between two ticks lies in memory of the integrator's own, which nothing else knows of:
the compiler keeps it in registers, and computes no signal of a trial state that nobody asks for.
"""

from typing import Any, NamedTuple

from hil_emulator.model.constants import ACTUATORS, PIECES, VELOCITY_DOUBT
from hil_emulator.model.exchange import balances, evaluate
from hil_emulator.model.sensors import observe
from hil_emulator.model.stages import spool_reach

STATE_LENGTH = 0
"""How many numbers a state holds: the module that `kernel` makes of a model has its own value."""

ELEMENTS = 1
"""How many effects are sensing elements; without any, nobody looks at what lies between samples."""


class Work(NamedTuple):
    """What an integration works on: state records of all actuators in each.

    Attributes:
        states: they are given and moved.
        trial: states at which the balances are evaluated.
        slopes: the rates there; given as zero, which those of effects that are off remain.
        mean: sum of a step's four slopes, each with its weight.
        bend: sum of them that vanishes where they are a straight line in time.

    """

    states: Any
    trial: Any
    slopes: Any
    mean: Any
    bend: Any


def as_floats(records: Any) -> Any:
    """Stand for the compiled function that shows the memory of records, see `array_memory`."""
    raise TypeError("'as_floats' runs only in the module that kernel.build makes")


def sum_slopes(
    work: Work, par: Any, held: Any, y: Any, path: Any, done: int, step: float
) -> None:  # fmt: skip
    """Sum the four slopes of a classical Runge-Kutta step.

    The first is that of the states: there the sensors' elements meet what the last step came to.

    Args:
        work: memory of the integration, with the states.
        par: as of `integrate`.
        held: as of `integrate`.
        y: as of `integrate`.
        path: takes what they meet.
        done: number of steps that have been taken; 0 in the midst of one, and of a call's first.
        step: width of this one [s].

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
    """Leave each spool at rest where its housing stops it."""
    for i in range(ACTUATORS):
        reach = spool_reach(par[i], x[i], dx[i], x[i].spool_position)
        if reach != x[i].spool_position:
            x[i].spool_position = reach
            x[i].spool_speed = 0.0


def unsure(bends: Any, step: float) -> bool:
    """Tell whether an acceleration bends more within a step than a smooth motion lets it.

    It does where something hits: an end stop, a wall, the flanks of a backlash, a light rod on a
    stiff load cell.
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

    A step in which something hits is taken in pieces instead. The actuators of one supply take
    every stage of every step together: what they exchange is as exact as everything else.

    Args:
        work: the states, and memory of the integration's own.
        par: parameters of each actuator.
        held: inputs and what follows from parameters, constant over the call, of each.
        y: signals of each; they belong to the states reached.
        path: what the sensors' elements meet after each step, channels of all actuators one after
            the other, shape (steps, actuators * channels); overwritten, without elements only the
            last of them.
        first: row of `path` that the first step fills.
        step: step width [s].
        steps: number of steps.

    """
    done = 0
    pieces = 0
    while done < steps:
        width = step if pieces == 0 else step / PIECES
        seen = first + done if pieces == 0 and done > 0 else 0
        sum_slopes(work, par, held, y, path, seen, width)
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
    """Tell whether every number of the states is finite: zero times any other is NaN."""
    remainder = 0.0
    for i in range(STATE_LENGTH * ACTUATORS):
        remainder += 0.0 * memory[i]
    return remainder == 0.0


INTEGRATOR = (sum_slopes, advance, arrest, unsure, integrate, finite)
"""What `kernel` compiles of this file, in the order of use."""
