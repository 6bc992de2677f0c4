"""Transition matrix of a run from one sample to the next.

Finite differences of the model's rates give A = dx'/dx by the states x and by some parameters;
between two evaluations their mean is used. The map over a step h is the third-order L-stable Padé
approximant of exp(h A), (1 + s/3)/(1 - 2s/3 + s²/6) (Ehle 1969; Hairer and Wanner, Solving Ordinary
Differential Equations II, IV.3). It damps modes that are too fast for the step, such as the
deflection of sliding seals, for which the stability polynomial of Runge-Kutta would diverge.
"""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import Data, ParametrisedModel, Start
from hil_emulator.identify.prediction.model_run.run import Passage
from hil_emulator.identify.prediction.model_run.small_matrices import divide, duplicate, multiply


class Slopes(NamedTuple):
    """Derivatives by the elements: n states of z, then parameters that stay constant or decay.

    Attributes:
        places: indices of these parameters in `par`.
        kept: decay of each parameter over a part of a period.
        widths: steps of the differences, shape (elements,).
        rates: derivative of the states' rates, shape (n, elements).
        before: the same at the previous evaluation.
        readings: derivative of the readings, shape (chosen, elements).
        onward: derivative of the elements by their values at the start of the period, shape
            (elements, elements).
        sensed: derivative of the readings by the same values, shape (chosen, elements).
        speed: index of the velocity in z.
        chambers: indices of the chambers' states in z.
        secant: step of the velocity's secant, 0 without, shape (1,).
        still: rates of all states.
        moved: rates with one element changed.
        signals: the model's signals.
        moved_signals: signals with one element changed.
        scaled: memory for products, shape (n, elements).
        step: map over a step, shape (n, elements).
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
        start: with the active states; the first parameters are its disturbances.
        data: with the chosen readings.
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
    """Compute the derivatives of rates and readings at the present state of a run."""
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
    """Compute `step`, the map over some steps of a width [s]."""
    x, step, left, widths = slopes.scaled, slopes.step, slopes.left, slopes.widths
    n, halvings = len(x), 0
    while 2**halvings < steps:
        halvings += 1
    width *= steps / 2**halvings
    # scaled by the widths, so that pivots are of similar size
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
    """Compute `step`, the approximant of exp(x), x = h A; overwrites `left`."""
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
                # rows of parameters are zero; their influence is on the right side
                step[i, j] = x[i, j] - square / 6.0
    divide(left, step)


def carry_on(slopes: Slopes) -> None:
    """Multiply `onward` by the map `step` of a part of the period."""
    onward, step, after, n = slopes.onward, slopes.step, slopes.scaled, len(slopes.step)
    for i in range(n, len(onward)):
        for j in range(len(onward)):
            onward[i, j] *= slopes.kept[i - n]
    multiply(step, onward, after)
    for i in range(n):
        for j in range(len(onward)):
            onward[i, j] = after[i, j]
