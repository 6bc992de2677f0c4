"""The baselines as examiners: the same cases, the same kind of answer as the product's."""

import math
import time

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE, KNEE
from tests.studies.answer import Answer, Named
from tests.studies.baselines.replay import CHANNELS, Replay, Way
from tests.studies.baselines.selection import Model, by_bic, by_thresholds
from tests.studies.generator.cases import Case, campaign


def _ready(case: Case, way: Way) -> tuple[Replay, list[Coordinate], list[Coordinate]]:
    model = PlantModel(load([KNEE]), CACHE)
    train, _ = campaign(case)
    candidates = parameters.candidates(model, CHANNELS)
    return Replay(model, train, way), parameters.ordinary(model), candidates


def bic(case: Case, way: Way) -> Answer:
    """Name effects by forward selection with BIC."""
    replay, nuisances, candidates = _ready(case, way)
    start = time.monotonic()
    model, chosen = by_bic(replay, nuisances, candidates)
    named = tuple(_named(model, c) for c in chosen)
    return _answer(named, start)


def open_loop(case: Case) -> Answer:
    """Open-loop simulation and BIC."""
    return bic(case, "open loop")


def multiple_shooting(case: Case) -> Answer:
    """Shots of 200 ms and BIC."""
    return bic(case, "multiple shooting")


def equation_error(case: Case) -> Answer:
    """Equation error and BIC."""
    return bic(case, "equation error")


def stlsq(case: Case) -> Answer:
    """Sparse regression on the equation error."""
    replay, nuisances, candidates = _ready(case, "equation error")
    start = time.monotonic()
    _, kept = by_thresholds(replay, nuisances, candidates)
    named = tuple(Named(c.name, value=c.value(a), low=math.nan, high=math.nan) for c, a in kept)
    return _answer(named, start)


def _named(model: Model, chosen: Coordinate) -> Named:
    i = [c.name for c in model.free].index(chosen.name)
    at, spread = float(model.at[i]), float(model.deviations()[i])
    ends = sorted(chosen.value(at + k * spread) for k in (-1.96, 1.96))
    return Named(chosen.name, value=float(chosen.value(at)), low=ends[0], high=ends[1])


def _answer(named: tuple[Named, ...], start: float) -> Answer:
    seconds = time.monotonic() - start
    verdict = "missing_effects" if named else "nothing_missing"
    nearest = named[0].name if named else ""
    return Answer(named, nearest=nearest, verdict=verdict, seconds=float(np.round(seconds, 1)))
