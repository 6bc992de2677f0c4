"""Delay of set points to the valves: the set points that act in a tick, and the time of change."""

from typing import Any

from hil_emulator.model.constants import ACTUATORS
from hil_emulator.model.integrator import Work, integrate
from hil_emulator.model.stages import arrival, early_set_point, late_set_point, set_point


def await_set_point(par: Any, held: Any, past: Any, step: float, steps: int) -> None:
    """Compute the set points that act on a valve within a tick, and the time of change.

    Args:
        par: parameters.
        held: holds the present set point; receives the early and the late set point.
        past: set points of earlier ticks.
        step: step width [s].
        steps: number of steps of the tick; with 0 steps the present set point acts.

    """
    held.late_current = held.valve_current
    held.early_current = held.valve_current
    held.arrival = 0.0
    if steps > 0:
        sent = set_point(par, held, held, past, held.valve_current, step * steps)
        held.late_current = late_set_point(par, held, held, past, sent, step * steps)
        held.early_current = early_set_point(par, held, held, past, sent, step * steps)
        held.arrival = arrival(par, held, held, past, step * steps) / step


def pass_set_points(
    work: Work, par: Any, held: Any, y: Any, path: Any, step: float, steps: int
) -> None:  # fmt: skip
    """Take `steps` steps with the early set point of each valve, then with the late one.

    A step within which a set point arrives is divided.

    Args:
        work: as of `integrate`.
        par: as of `integrate`.
        held: as of `integrate`, with both set points of each valve, and the arrival of the late
            one.
        y: as of `integrate`.
        path: as of `integrate`.
        step: step width [s].
        steps: number of steps.

    """
    at = 0.0
    going = True
    while going:
        until = 1.0 * steps
        for i in range(ACTUATORS):
            late = held[i].arrival <= at
            held[i].valve_current = held[i].late_current if late else held[i].early_current
            until = until if late else min(until, held[i].arrival)
        row = int(at)
        count = int(until) - row
        end = 1.0 * (row + count)
        width = step
        if steps > 0 and (at > row or count == 0):
            count = 1
            end = min(until, row + 1.0)
            width = (end - at) * step
        integrate(work, par, held, y, path, row, width, count)
        at = end
        going = at < steps


SET_POINTS = (await_set_point, pass_set_points)
"""What `kernel` compiles of this file, in the order of use."""
