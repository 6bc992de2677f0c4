"""Jacobian of one sample period, with which the extended Kalman filter propagates its covariance.

It follows from the Jacobian of the rates (`transition`), with two exceptions:

- At creep velocity, friction is strongly nonlinear within the uncertainty of the velocity. A second
  run with the velocity changed by its standard deviation gives a secant.
- In a nearly empty chamber the stiffness of the gas changes within the period. A second run per
  state gives finite differences.
"""

from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.filter.transition import (
    Slopes,
    carry_on,
    differentiate,
    map_part,
)
from hil_emulator.identify.prediction.model_run.run import (
    Passage,
    begin_period,
    elapse,
    elapse_part,
    end_period,
    follow,
)
from hil_emulator.identify.prediction.model_run.small_matrices import multiply
from hil_emulator.model.constants import SLIDING_BEND
from hil_emulator.model.effects.oil import LARGEST_GAS_PRESSURE

NEARLY_EMPTY = 2.0 * LARGEST_GAS_PRESSURE
"""State of a chamber below which it is nearly empty [Pa] (assumed: twice the pressure at which gas
may be as soft as oil, which a period can cross)."""

CREEPING = 2.0
"""Velocity over the width of its secant below which the rod creeps (assumed)."""

SLID = SLIDING_BEND - 0.2
"""Deflection of sliding seals: dry friction is within 0.3 % of its limit, tanh 3 over tanh 2.8."""


def elapse_linearly(passage: Passage, k: int, slopes: Slopes) -> None:
    """Advance by one sample period, and compute the Jacobian over it."""
    run, currents, onward = passage.run, passage.data.current[k], slopes.onward
    follow(passage.corrected, run)
    for i in range(len(onward)):
        for j in range(len(onward)):
            onward[i, j] = 1.0 if i == j else 0.0
    begin_period(run)
    for i in range(len(currents)):
        elapse_part(run, currents, i, passage.steps)
        differentiate(passage, slopes)
        map_part(slopes, run.step, passage.steps)
        carry_on(slopes)
    end_period(run)
    multiply(slopes.readings, onward, slopes.sensed)
    before, after = passage.corrected.z, run.z
    slow = slopes.secant[0] > 0.0 and creeps(slopes, before, after, run.bend)
    empty = empties(slopes, before, after)
    for j in range(len(onward)):
        wide = slow and j == slopes.speed
        if wide or empty:
            move_on(passage, k, slopes, j, slopes.secant[0] if wide else slopes.widths[j])


def empties(slopes: Slopes, before: Array, after: Array) -> bool:
    """Return whether a chamber is nearly empty."""
    lowest = NEARLY_EMPTY
    for i in slopes.chambers:
        lowest = min(lowest, before[i], after[i])
    return lowest < NEARLY_EMPTY


def creeps(slopes: Slopes, before: Array, after: Array, bend: int) -> bool:
    """Return whether friction is strongly nonlinear within the secant of the velocity."""
    v0, v1 = before[slopes.speed], after[slopes.speed]
    if v0 * v1 < 0.0 or min(abs(v0), abs(v1)) < CREEPING * slopes.secant[0]:
        return True
    return bend >= 0 and before[bend] * v0 < SLID * abs(v0)


def move_on(passage: Passage, k: int, slopes: Slopes, j: int, width: float) -> None:
    """Compute column `j` of the Jacobian from a second run with that element changed."""
    run, moved, data = passage.run, passage.moved, passage.data
    follow(moved, passage.corrected)
    place, here = 0, moved.par[0]
    if j < len(moved.z):
        moved.z[j] += width
    else:
        place = slopes.places[j - len(moved.active)]
        here = moved.par[place]
        moved.par[place] = here + width
    elapse(moved, data.current[k], passage.steps)
    moved.par[place] = here
    for i in range(len(run.z)):
        slopes.onward[i, j] = (moved.z[i] - run.z[i]) / width
    for i in range(len(data.chosen)):
        source = run.sources[data.chosen[i]]
        slopes.sensed[i, j] = (moved.signals[source] - run.signals[source]) / width


def read_widely(passage: Passage, slopes: Slopes) -> None:
    """Replace the readings' derivative by the velocity with a secant."""
    run, chosen, width = passage.run, passage.data.chosen, slopes.secant[0]
    place = run.active[slopes.speed]
    here = run.memory[place]
    run.memory[place] = here + width
    passage.rate(run.memory, slopes.moved, run.par, run.inputs, slopes.moved_signals)
    run.memory[place] = here
    for i in range(len(chosen)):
        source = run.sources[chosen[i]]
        change = slopes.moved_signals[source] - slopes.signals[source]
        slopes.readings[i, slopes.speed] = change / width


def note(slopes: Slopes, first: int, maps: Single, senses: Single) -> None:
    """Store the derivatives of the next z and readings by elements from index `first` on."""
    for j in range(maps.shape[1]):
        for i in range(len(maps)):
            maps[i, j] = slopes.onward[i, first + j]
        for i in range(len(senses)):
            senses[i, j] = slopes.sensed[i, first + j]
