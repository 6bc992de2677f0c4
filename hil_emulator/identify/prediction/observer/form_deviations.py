"""What base laws of another published form would do along a run."""

from collections.abc import Iterator

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.model.declare import is_on
from hil_emulator.model.law_forms import FORMS, USUAL, ModelRun

BENT = 3.0
"""Standard deviations at which the curvature of an effect is taken."""

CURVATURE = 1.0 / 3.0
"""Standard deviation of k(k - 1)/6, with k of a standard normal distribution: an effect k standard
deviations large has that part of the second difference."""


def deviations(
    predictor: Predictor, frozen: Frozen, par: Array, chan: Array
) -> tuple[tuple[str, ...], Array]:
    """Return what one standard deviation of each difference does along the run at a point.

    Returns:
        the law of each difference in words, and weighted whitened innovations, shape (differences,
        residuals).

    """
    path = predictor.innovations(frozen, par, chan, track=True)[1]
    signals = {name: path[:, i] for i, name in enumerate(predictor.model.signal_names)}
    names = predictor.model.kernel.parameters.names or ()
    plant = dict(zip(names, par.tolist(), strict=True))
    usual = dict(zip(names, predictor.model.par.tolist(), strict=True))
    run = ModelRun(signals, plant, usual)
    balances = {b.name: b for b in predictor.balances if not b.channel}
    laws: list[str] = []
    changes = [np.zeros((0, frozen.data.measured.size))]
    for form in (f for f in FORMS if set(f.balances) <= set(balances)):
        terms = form.terms(run)
        each = [predictor.through(frozen, balances[name], terms[name]) for name in terms]
        changes.append(np.sum(each, axis=0, dtype=np.float64))
        laws += [form.law] * len(changes[-1])
    for law, change in _usual(predictor, frozen, par, chan):
        laws += [law] * len(change)
        changes.append(change)
    return tuple(laws), np.concatenate(changes)


def _usual(
    predictor: Predictor, frozen: Frozen, par: Array, chan: Array
) -> Iterator[tuple[str, Array]]:
    """Yield the same of each effect that every machine has a little of, shape (2, residuals).

    Twice an effect does not do twice as much: the second difference holds by how much.
    """
    model, base = predictor.model, predictor.innovations(frozen, par, chan)[0]
    effects = {e.name: e for e in model.effects}
    for usual in (u for u in USUAL if u.name in effects):
        knob = effects[usual.name].field_of(effects[usual.name].knob)
        at = list(model.kernel.parameters.names or ()).index(knob)
        if is_on(effects[usual.name], par[at]):
            continue
        changes = []
        for size in (1.0, BENT):
            other = par.copy()
            other[at] = size * usual.size(model.plant_values)
            changes.append((predictor.innovations(frozen, other, chan)[0] - base).ravel())
        bend = CURVATURE * (changes[1] - BENT * changes[0])
        yield usual.law, np.stack([changes[0], bend])
