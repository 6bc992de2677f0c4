"""Disagreement of model and measurement per channel, one step ahead and in free runs.

Each model has its own filter, from whose states its free runs restart. All models are compared with
the same readings, so their numbers can be compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np

from hil_emulator.identify.disagreement.freerun import Replay, replay
from hil_emulator.identify.disagreement.noise_floor import Floor, spread, strengths
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.benches.force_balance import MeasuredStates
from hil_emulator.identify.prediction.benches.sweep_bench import SweepStates
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import Point, side_by_side

Gap = dict[str, dict[str, dict[str, float]]]
"""By channel and part of the data: see `measure`."""

KINDS = {"": "one_step", "free_": "free"}
"""Attribute of `Replay` by the prefix of a number in a gap."""


@dataclass(frozen=True)
class View:
    """One experiment and one model.

    Attributes:
        experiment: the data.
        replay: errors of the model; benches without a complete actuator have no free run.
        noise: standard deviation of each channel's noise, or 1 in its unit, shape (channels,).
        floors: variance from noise and disturbances at assumed strengths; None if unknown.
        strength: of each source of the floor in this experiment, see `noise_floor.strengths`.

    """

    experiment: Experiment
    replay: Replay
    noise: Array
    floors: Floor | None = None
    strength: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Compared:
    """Two models over training and validation data.

    Attributes:
        before: the configured model, ordinary parameters refitted, by part of the data.
        after: the final model, by part of the data.

    """

    before: dict[str, list[View]]
    after: dict[str, list[View]]


def view(predictor: Predictor, fit: Fit, experiments: Sequence[Experiment]) -> list[View]:
    """Return the views of experiments with a fitted model."""
    point = predictor.model.memory(fit.coordinates, fit.at)
    return [_view(predictor, e, point, with_floors=False) for e in experiments]


def _view(predictor: Predictor, experiment: Experiment, point: Point, with_floors: bool) -> View:
    """Return the view of one experiment with a model."""
    frozen = predictor.freeze(experiment, *point)
    if isinstance(predictor, Observer) and isinstance(frozen, Frozen):
        run = replay(predictor, frozen, *point)
        plain = View(experiment, run, frozen.noise)
        if not with_floors:
            return plain
        floors = spread(predictor, frozen, run)
        strength = strengths([floors], [run], experiment.period)
        return replace(plain, floors=floors, strength=strength)
    residual, track = predictor.innovations(frozen, *point, track=True)
    assert isinstance(frozen, MeasuredStates)
    residual = np.where(frozen.present[:, None], residual, np.nan)
    empty = np.full_like(residual, np.nan)
    run = Replay(residual, empty, np.zeros(len(residual), np.int64), track)
    noise = frozen.noise if isinstance(frozen, SweepStates) else np.ones(residual.shape[1])
    return View(experiment, run, noise)


def compare(
    predictor: Predictor, before: Fit, after: Fit, training: Sequence[Experiment],
    validation: Sequence[Experiment], jobs: int = 1,
) -> Compared:  # fmt: skip
    """Return the views of all data with two models; those of the second have floors."""
    parts = {n: e for n, e in {"training": training, "validation": validation}.items() if e}
    models = [after] if after is before else [before, after]
    pairs = [(fit, e) for fit in models for part in parts.values() for e in part]

    def one_view(pair: tuple[Fit, Experiment]) -> View:
        fit, experiment = pair
        point = predictor.model.memory(fit.coordinates, fit.at)
        return _view(predictor, experiment, point, with_floors=fit is after)

    views = side_by_side(one_view, pairs, jobs)
    by_part = [{name: list(islice(views, len(e))) for name, e in parts.items()} for _ in models]
    return Compared(by_part[0], by_part[-1])


def measure(predictor: Predictor, compared: Compared) -> Gap:
    """Return the root mean square of the disagreement by channel and part of the data.

    Each entry holds `before`, `after` and `floor` of the error one step ahead, in
    `predictor.measure`: multiples of the channel's noise, or a unit. With the prefix `free_` they
    are of the free run. The suffix `_rms` is in the channel's SI unit, `_percent` is relative to
    the standard deviation of its readings. Unknown numbers are absent.
    """
    gap: Gap = {}
    for part, views in compared.after.items():
        enter(gap, predictor, part, "before", compared.before[part])
        enter(gap, predictor, part, "after", views)
        for i, channel in enumerate(predictor.channels):
            for prefix, kind in KINDS.items():
                if all(v.floors is not None for v in views):
                    left = [floor_of(v, kind)[:, i] for v in views]
                    _enter(gap[channel][part], f"{prefix}floor", channel, views, i, left)
    return gap


def enter(gap: Gap, predictor: Predictor, part: str, when: str, views: Sequence[View]) -> None:
    """Enter the errors of a model over a part of the data."""
    for i, channel in enumerate(predictor.channels):
        entry = gap.setdefault(channel, {}).setdefault(part, {})
        for prefix, kind in KINDS.items():
            errors = [getattr(v.replay, kind)[:, i] for v in views]
            _enter(entry, f"{prefix}{when}", channel, views, i, errors)


def floor_of(view: View, kind: str) -> Array:
    """Return the standard deviation of a perfect model's error, NaN where the error is NaN."""
    assert view.floors is not None
    deviation = np.sqrt(np.tensordot(view.strength, getattr(view.floors, kind), 1))
    return np.asarray(np.where(np.isfinite(getattr(view.replay, kind)), deviation, np.nan))


def _enter(
    entry: dict[str, float], name: str, channel: str, views: Sequence[View], i: int,
    errors: Sequence[Array],
) -> None:  # fmt: skip
    """Enter a root mean square in units of noise, in SI, and in percent of the readings' spread."""
    in_noise = np.concatenate([e / v.noise[i] for e, v in zip(errors, views, strict=True)])
    if not np.isfinite(in_noise).any():
        return
    entry[name] = float(np.sqrt(np.nanmean(in_noise**2)))
    rms = float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2)))
    entry[f"{name}_rms"] = rms
    spread_of_readings = np.nanstd(np.concatenate([v.experiment.readings[channel] for v in views]))
    if spread_of_readings > 0.0:
        entry[f"{name}_percent"] = float(100.0 * rms / spread_of_readings)


def traces(predictor: Predictor, compared: Compared) -> dict[str, dict[str, Array]]:
    """Return measurement and errors of both models, by `experiment/channel`.

    Each entry holds `time` [s], `measured`, the errors one step ahead `before` and `after`, those
    of the free run `free_before` and `free_after`, all SI, and `noise`, one number.
    """
    by_channel: dict[str, dict[str, Array]] = {}
    for part, views in compared.before.items():
        for old, new in zip(views, compared.after[part], strict=True):
            e = old.experiment
            for i, channel in enumerate(predictor.channels):
                by_channel[f"{e.name}/{channel}"] = {
                    "time": np.arange(e.samples, dtype=np.float64) * e.period,
                    "measured": e.readings[channel], "noise": old.noise[i : i + 1],
                    "before": old.replay.one_step[:, i], "after": new.replay.one_step[:, i],
                    "free_before": old.replay.free[:, i], "free_after": new.replay.free[:, i],
                }  # fmt: skip
    return by_channel
