"""How a small change grows until the next sample: the transition matrix of a run.

Differences of the model's rates tell A = dx'/dx at every moment, of the states x by themselves and
by some parameters; between two moments the mean of both holds. A step of width h maps a change by
the Padé approximant of exp(h A) that is of third order and L-stable, (1 + s/3)/(1 - 2s/3 + s²/6)
(Ehle 1969; Hairer and Wanner, Solving Ordinary Differential Equations II, IV.3): what is too fast
for a step is forgotten in it, as the seals' bend is once they slide, where the polynomial of
Runge-Kutta would let it grow.
"""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import Data, ParametrisedModel, Start
from hil_emulator.identify.prediction.model_run.run import Passage
from hil_emulator.identify.prediction.model_run.small_matrices import divide, duplicate, multiply


class Slopes(NamedTuple):
    """Derivatives by what changes: the n states of z, then parameters that stay or fade.

    Attributes:
        places: indices of these parameters in `par`.
        kept: what remains of each after a part of a period.
        widths: steps of the differences, shape (changes,).
        rates: derivative of the states' rates, shape (n, changes).
        before: the same at the moment before.
        readings: derivative of the readings, shape (chosen, changes).
        onward: derivative of what changes by what it was when the period began, shape
            (changes, changes).
        sensed: derivative of the readings by the same, shape (chosen, changes).
        speed: index of the velocity in z.
        chambers: indices of the chambers' states in z.
        secant: step of its wide difference, 0 for none, shape (1,).
        still: rates of all states.
        moved: the same a width away.
        signals: the model's signals.
        moved_signals: the same a width away.
        scaled: memory for products, shape (n, changes).
        step: the same.
        left: memory for the left side of an equation, shape (n, n).

    """

    places: Index
    kept: Array
    widths: Array
    rates: Array
    before: Array
    readings: Array
    onward: Array
    sensed: Array
    speed: int
    chambers: Index
    secant: Array
    still: Array
    moved: Array
    signals: Array
    moved_signals: Array
    scaled: Array
    step: Array
    left: Array


def slopes_of(
    model: ParametrisedModel, start: Start, data: Data, places: Index, widths: Array
) -> Slopes:
    """Return memory for derivatives by the states of z and some parameters.

    Args:
        model: whose rates are differentiated.
        start: whose active states count; the first of the parameters are its disturbances.
        data: whose readings count.
        places: indices of the parameters.
        widths: steps of the differences.

    """
    n, m, count = len(start.active), len(data.chosen), len(widths)
    kept = np.ones(len(places))
    for i in range(len(start.decay)):
        kept[i] = start.decay[i]
    speed, chambers = 0, np.zeros(len(model.chambers), np.int64)
    for i in range(n):
        if start.active[i] == model.velocity:
            speed = i
        for j in range(len(chambers)):
            if start.active[i] == model.chambers[j]:
                chambers[j] = i
    return Slopes(
        places, kept, widths.copy(), np.zeros((n, count)), np.zeros((n, count)),
        np.zeros((m, count)), np.zeros((count, count)), np.zeros((m, count)), speed, chambers,
        np.zeros(1), np.zeros(len(start.state)), np.zeros(len(start.state)),
        np.zeros(model.signals), np.zeros(model.signals), np.zeros((n, count)),
        np.zeros((n, count)), np.zeros((n, n)),
    )  # fmt: skip


def differentiate(passage: Passage, slopes: Slopes) -> None:
    """Find the derivatives of rates and readings where a run is."""
    run, chosen, widths = passage.run, passage.data.chosen, slopes.widths
    n, still, moved = len(run.active), slopes.still, slopes.moved
    duplicate(slopes.rates, slopes.before)
    passage.rate(run.memory, still, run.par, run.inputs, slopes.signals)
    for j in range(len(widths)):
        changed = run.memory if j < n else run.par
        place = run.active[j] if j < n else slopes.places[j - n]
        here = changed[place]
        changed[place] = here + widths[j]
        passage.rate(run.memory, moved, run.par, run.inputs, slopes.moved_signals)
        changed[place] = here
        per = 1.0 / widths[j]
        for i in range(n):
            slopes.rates[i, j] = (moved[run.active[i]] - still[run.active[i]]) * per
        for i in range(len(chosen)):
            source = run.sources[chosen[i]]
            slopes.readings[i, j] = (slopes.moved_signals[source] - slopes.signals[source]) * per


def map_part(slopes: Slopes, width: float, steps: int) -> None:
    """Fill `step` with the map over some steps of a width [s]."""
    x, step, left, widths = slopes.scaled, slopes.step, slopes.left, slopes.widths
    n, halvings = len(x), 0
    while 2**halvings < steps:
        halvings += 1
    width *= steps / 2**halvings
    # in these units one pivot is as large as another
    for i in range(n):
        for j in range(x.shape[1]):
            mean = 0.5 * (slopes.before[i, j] + slopes.rates[i, j])
            x[i, j] = width * mean * (widths[j] / widths[i])
    approximate(x, left, step)
    for _ in range(halvings):
        duplicate(step, x)
        for i in range(n):
            for j in range(x.shape[1]):
                total = 0.0 if j < n else x[i, j]
                for k in range(n):
                    total += x[i, k] * x[k, j]
                step[i, j] = total
    for i in range(n):
        for j in range(x.shape[1]):
            step[i, j] *= widths[i] / widths[j]


def approximate(x: Array, left: Array, step: Array) -> None:
    """Fill `step` with the approximant of exp(x), x = h A; overwrites `left`."""
    n = len(x)
    for i in range(n):
        for j in range(x.shape[1]):
            square = 0.0
            for k in range(n):
                square += x[i, k] * x[k, j]
            if j < n:
                same = 1.0 if i == j else 0.0
                left[i, j] = same - 2.0 / 3.0 * x[i, j] + square / 6.0
                step[i, j] = same + x[i, j] / 3.0
            else:
                # rows of parameters are zero: what these do is brought to the right side
                step[i, j] = x[i, j] - square / 6.0
    divide(left, step)


def carry_on(slopes: Slopes) -> None:
    """Carry `onward` over the part whose map is `step`."""
    onward, step, after, n = slopes.onward, slopes.step, slopes.scaled, len(slopes.step)
    for i in range(n, len(onward)):
        for j in range(len(onward)):
            onward[i, j] *= slopes.kept[i - n]
    multiply(step, onward, after)
    for i in range(n):
        for j in range(len(onward)):
            onward[i, j] = after[i, j]
