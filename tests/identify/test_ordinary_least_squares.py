"""A plain fit of the same parameters, against the normal equations."""

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.data_checks.direction import dissipative
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.ordinary_least_squares import ordinary_least_squares
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.prediction.benches.force_balance import StaticObserver
from hil_emulator.identify.prediction.plant.parameters import UNKNOWN_SEALS, candidates, ordinary
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE
from tests.studies.logs.rates import DATA, terms

NAMES = ("coulomb_friction", "pressure_friction")


def test_a_balance_of_forces_gives_what_the_normal_equations_give() -> None:
    """Area, dry friction and its growth with pressure are linear in the force: one solution.

    Prior and noise, which pull on the search's own fit, leave no trace.
    """
    model = PlantModel(load([DATA / "friction_rig.toml"]), CACHE)
    logs = dissipative(
        load_experiments([DATA / f"oring_{bar}bar.csv" for bar in (1, 5)]), model.plant_values
    )
    named = {c.name: c for c in candidates(model, ("load_force",))}
    area = [c for c in ordinary(model, UNKNOWN_SEALS) if c.name in UNKNOWN_SEALS]
    free = [*area, *(named[name] for name in NAMES)]
    start = Fit(free, np.array([0.0, 0.1, 0.1]), np.zeros(0), np.zeros((0, 3)), 0.0)
    fit = ordinary_least_squares(StaticObserver(model), logs, start)
    rows, force = terms(model, logs)
    expected = np.linalg.lstsq(rows, force, rcond=None)[0]
    values = [c.value(float(at)) for c, at in zip(fit.coordinates, fit.at, strict=True)]
    assert values == pytest.approx(expected, rel=2e-3)
