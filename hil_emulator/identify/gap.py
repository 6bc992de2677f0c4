"""Where model and measurement disagree: per channel, one step ahead and simulated freely."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hil_emulator.identify.experiment import SPANS, Array, Experiment
from hil_emulator.identify.fit import Fit
from hil_emulator.identify.predictor import Predictor

Gap = dict[str, dict[str, dict[str, float]]]


def one_step(
    predictor: Predictor, before: Fit, after: Fit, training: Sequence[Experiment],
    validation: Sequence[Experiment],
) -> Gap:  # fmt: skip
    """Return the root mean square of whitened innovations by channel, before and after.

    Both are seen through the gains of the model before, so that they are comparable.
    """
    found: Gap = {}
    for name, experiments in (("training", training), ("validation", validation)):
        if not experiments:
            continue
        frozen = [_frozen(predictor, before, e) for e in experiments]
        for when, fit in (("before", before), ("after", after)):
            par, chan = predictor.twin.memory(fit.coordinates, fit.at)
            values = np.vstack([predictor.innovations(f, par, chan)[0] for f in frozen])
            for i, channel in enumerate(predictor.channels):
                rms = float(np.sqrt(np.mean(values[:, i] ** 2)))
                found.setdefault(channel, {}).setdefault(name, {})[when] = rms
    return found


def _frozen(predictor: Predictor, fit: Fit, experiment: Experiment) -> Any:
    par, chan = predictor.twin.memory(fit.coordinates, fit.at)
    return predictor.freeze(experiment, par, chan)


def traces(
    predictor: Predictor, before: Fit, after: Fit, experiments: Sequence[Experiment]
) -> dict[str, dict[str, Array]]:
    """Return innovations over time before and after, by `experiment/channel`."""
    found: dict[str, dict[str, Array]] = {}
    for experiment in experiments:
        frozen = _frozen(predictor, before, experiment)
        parts = {}
        for when, fit in (("before", before), ("after", after)):
            par, chan = predictor.twin.memory(fit.coordinates, fit.at)
            parts[when] = predictor.innovations(frozen, par, chan)[0]
        for i, channel in enumerate(predictor.channels):
            time = np.asarray(np.arange(experiment.samples, dtype=np.float64) * experiment.period)
            found[f"{experiment.name}/{channel}"] = {
                "time": time, "before": parts["before"][:, i], "after": parts["after"][:, i],
                "measured": experiment.readings[channel] / SPANS[channel],
            }  # fmt: skip
    return found
