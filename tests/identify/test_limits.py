"""Limits without a configured value: off is infinity, where the sensitivity is zero."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import Configuration, load
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.scan import scan
from hil_emulator.identify.selection.starts import NonlinearCheck
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, KNEE
from tests.studies.generator.bench import TRAINING, VALIDATION, record
from tests.studies.generator.cases import case, machine
from tests.studies.generator.sensors import CHANNELS

RATE = 1.5
"""Rate limit of the machine's spool [A/s]: its largest steps take 8 ms."""


@pytest.fixture(scope="module")
def unlimited(tmp_path_factory: pytest.TempPathFactory) -> Configuration:
    """Return the reference machine, whose data sheet states no rate limit of the spool."""
    lines = KNEE.read_text().replace("../eds", str(KNEE.parents[1] / "eds")).splitlines()
    kept = [line for line in lines if not line.startswith("spool_rate_limit")]
    file: Path = tmp_path_factory.mktemp("unlimited") / "knee.toml"
    file.write_text("\n".join(kept))
    return load([file])


def recorded(kind: str, rate: float = RATE, duration: float = 1.0) -> Experiment:
    """Return a log of the independent plant, healthy except for its spool."""
    healthy = machine(case("none", 4))._replace(spool_rate=rate)
    return record(healthy, {}, kind, (7, kind == "steps"), duration, False)


@pytest.mark.slow
def test_an_inactive_limit_is_tried_at_finite_values(unlimited: Configuration) -> None:
    """Its sensitivity is zero, but it is the best candidate."""
    model = PlantModel(unlimited, CACHE)
    fitter = Fitter(Observer(model, CHANNELS), [recorded("steps")])
    free = parameters.ordinary(model)
    base = converge(fitter, free, np.zeros(len(free)))
    limits = [c for c in parameters.candidates(model, CHANNELS) if c.inverse and not c.channel]
    scores = scan(fitter, base, limits)
    limit = next(s for s in scores if s.coordinate.name == "spool_rate_limit")
    assert limit.statistic == 0.0
    likeliest = NonlinearCheck(fitter, base).best(scores, 1)[0]
    assert likeliest.coordinate.name == "spool_rate_limit"
    assert likeliest.statistic > 100.0


@pytest.mark.full(sibling="test_an_inactive_limit_is_tried_at_finite_values")
@pytest.mark.parametrize("rate", [0.8, 2.0])
def test_a_slow_spool_is_named(unlimited: Configuration, rate: float) -> None:
    """A missing rate limit is named, and its interval covers the true value."""
    logs = [recorded(kind, rate, 2.0) for kind in (*TRAINING, *VALIDATION)]
    result = identify(unlimited, logs[: len(TRAINING)], logs[len(TRAINING) :], cache=CACHE)
    (effect,) = result.effects
    assert effect.name == "spool_rate_limit"
    low, high = effect.interval
    assert low <= rate <= high
