"""What base laws of another published form would do along a run."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.model.law_forms import FORMS, ModelRun


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
    run = ModelRun(signals, dict(zip(names, predictor.model.par.tolist(), strict=True)))
    balances = {b.name: b for b in predictor.balances if not b.channel}
    laws: list[str] = []
    changes = [np.zeros((0, frozen.data.measured.size))]
    for form in (f for f in FORMS if set(f.balances) <= set(balances)):
        terms = form.terms(run)
        each = [predictor.through(frozen, balances[name], terms[name]) for name in terms]
        changes.append(np.sum(each, axis=0, dtype=np.float64))
        laws += [form.law] * len(changes[-1])
    return tuple(laws), np.concatenate(changes)
