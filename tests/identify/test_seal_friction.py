"""Measured seals on a test machine (TU Delft, CC0): the force balance alone, irregular 100 Hz."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.prediction.benches.force_balance import StaticObserver
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.session import identify
from hil_emulator.platform.paths import cache_folder
from tests.studies.logs.rates import least_squares

DATA = Path(__file__).parent / "data"
CACHE = cache_folder()
FULL = pytest.mark.full(sibling="test_friction_and_its_growth_with_pressure_are_named")


def files(seal: str, *bars: int) -> list[Path]:
    """Return the recordings of a seal at some pressures."""
    return [DATA / f"{seal}_{bar}bar.csv" for bar in bars]


def examined(seal: str) -> Result:
    """Identify from 1 and 5 bar, validated at 3 and 7 bar."""
    config = load([DATA / "friction_rig.toml"])
    train, other = load_experiments(files(seal, 1, 5)), load_experiments(files(seal, 3, 7))
    return identify(config, train, other, cache=CACHE)


def error(result: Result, round_: int) -> float:
    """Return the held-out error of the model at the start of a round [N]."""
    from hil_emulator.identify.data_checks.direction import dissipative

    assert result.search is not None
    base = result.search.rounds[round_].base
    model = PlantModel(load([DATA / "friction_rig.toml"]), CACHE)
    observer = StaticObserver(model)
    everything = []
    for e in dissipative(
        load_experiments(files(result.notes[0].split("_")[0], 3, 7)), model.plant_values
    ):
        par, chan = model.memory(base.coordinates, base.at)
        frozen = observer.freeze(e, par, chan)
        residual = observer.innovations(frozen, par, chan)[0][frozen.present, 0]
        everything.append(residual)
    return float(np.sqrt(np.mean(np.concatenate(everything) ** 2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seal", "before"), [("oring", 6.0), pytest.param("napn", 9.0, marks=FULL)]
)
def test_friction_and_its_growth_with_pressure_are_named(seal: str, before: float) -> None:
    """Coulomb friction and its growth with pressure are found, and other pressures confirm it.

    The error counts where the seal slides: beyond 1 mm after a reversal. There it is that of least
    squares with the right effects.
    """
    result = examined(seal)
    names = [f.name for f in result.effects]
    assert set(names[:2]) == {"coulomb_friction", "pressure_friction"}
    assert error(result, 0) > before
    model = PlantModel(load([DATA / "friction_rig.toml"]), CACHE)
    logs = [load_experiments(files(seal, *bars)) for bars in ((1, 5), (3, 7))]
    assert error(result, -1) < 1.1 * least_squares(model, *logs)
