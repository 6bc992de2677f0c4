"""Innovations' changes by base laws of other published forms, along a run."""

from collections.abc import Iterator

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.model.declare import is_on
from hil_emulator.model.law_forms import FORMS, USUAL, ModelRun

BENT = 3.0
"""Size, in standard deviations, at which the curvature of an effect is computed."""

CURVATURE = 1.0 / 3.0
"""Standard deviation of k(k - 1)/6 for a standard normal k: the factor of the second difference for
an effect of k standard deviations."""


def deviations(
    predictor: Predictor, frozen: Frozen, par: Array, chan: Array
) -> tuple[tuple[str, ...], Array]:
    """Return the change of the innovations by one standard deviation of each difference.

    Returns:
        The law of each difference in words, and weighted whitened innovations, shape (differences,
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
    """Yield law and changes of each effect that is small in every machine, shape (2, residuals).

    The second row is the nonlinear part, from a second difference.
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
