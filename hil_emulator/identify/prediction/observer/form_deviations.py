"""What base laws of another published form would do along a run."""

from typing import TYPE_CHECKING

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.plant.rating import largest_current
from hil_emulator.model.declare import is_on
from hil_emulator.model.law_forms import FORMS, USUAL, Run

if TYPE_CHECKING:
    from hil_emulator.identify.prediction.observer.observer import Observer


def columns(observer: "Observer", frozen: Frozen, par: Array, chan: Array) -> Array:
    """Return what one standard deviation of each difference does along the run at a point.

    Returns:
        weighted whitened innovations, shape (differences, residuals).

    """
    path = observer.innovations(frozen, par, chan, track=True)[1]
    signals = {name: path[:, i] for i, name in enumerate(observer.model.signal_names)}
    plant = dict(zip(observer.model.kernel.parameters.names or (), par.tolist(), strict=True))
    run = Run(signals, plant, largest_current(plant), frozen.data.period)
    seen = {b.name: b for b in observer.balances if not b.channel}
    found = [np.zeros((0, frozen.data.measured.size))]
    for form in (f for f in FORMS if set(f.balances) <= set(seen)):
        terms = form.terms(run)
        each = [observer.through(frozen, seen[name], terms[name]) for name in terms]
        found.append(np.sum(each, axis=0, dtype=np.float64))
    return np.concatenate([*found, *_usual(observer, frozen, par, chan)])


def _usual(observer: "Observer", frozen: Frozen, par: Array, chan: Array) -> list[Array]:
    """Return the same of each effect that every machine has a little of, shape (1, residuals)."""
    model, base = observer.model, observer.innovations(frozen, par, chan)[0]
    effects = {e.name: e for e in model.effects}
    found = []
    for usual in (u for u in USUAL if u.name in effects):
        knob = effects[usual.name].field_of(effects[usual.name].knob)
        at = list(model.kernel.parameters.names or ()).index(knob)
        if is_on(effects[usual.name], par[at]):
            continue
        other = par.copy()
        other[at] = usual.size(model.plant_values)
        found.append((observer.innovations(frozen, other, chan)[0] - base).reshape(1, -1))
    return found
