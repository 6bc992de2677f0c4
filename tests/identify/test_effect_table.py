"""An unexplained term as a table: the file that is written, and the model that has it."""

from pathlib import Path

import numba
import numpy as np
import pytest

from hil_emulator.config.load import Configuration, load
from hil_emulator.identify.conclusion.effect_table import effect_table
from hil_emulator.identify.conclusion.findings import Unexplained, in_words
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.gap import compare, measure
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.reporting.layer import EFFECT_FILE, layer
from hil_emulator.identify.session import Question, identify
from hil_emulator.model.declare import Effect
from tests.identify.rig_data import CACHE, INSTRUMENTS, KNEE, knee
from tests.studies.generator.cases import Case, campaign

SPEEDS = (-0.3, -0.1, 0.0, 0.03, 0.15, 0.35)
DRAG = Unexplained("force on the piston", "velocity", "N", SPEEDS,
                   tuple(500.0 * v * abs(v) for v in SPEEDS), "odd", 1e4)  # fmt: skip
"""Drag with the square of speed, as a fit would find it."""


def added(folder: Path, term: Unexplained) -> Configuration:
    """Return the reference machine with a term added by the files that are written."""
    result = Result("unknown_effect", "something acts", unknown=[term], added=effect_table(term))
    assert result.added is not None
    (folder / EFFECT_FILE).write_text(result.added.text)
    (folder / "identified.toml").write_text(layer(result, [KNEE], "2026-01-01"))
    return load([KNEE, folder / "identified.toml"])


def law(folder: Path, term: Unexplained) -> Effect:
    """Return the effect that a term became."""
    return next(e for e in added(folder, term).effects if e.name.startswith("unexplained"))


def test_the_configuration_takes_the_table(tmp_path: Path) -> None:
    """The layer switches the effect on, at the size that was fitted."""
    assert added(tmp_path, DRAG).plant["unexplained_friction_over_velocity_factor"] == 1.0


def test_the_law_goes_through_the_fitted_values(tmp_path: Path) -> None:
    """At the knots it is the fit; between them it lies between its neighbours."""
    effect = law(tmp_path, DRAG)
    for v, force in zip(SPEEDS, DRAG.curve, strict=True):
        assert effect(v, 1.0) == pytest.approx(force, rel=1e-5)
    grid = np.linspace(SPEEDS[0], SPEEDS[-1], 301)
    forces = [effect(float(v), 1.0) for v in grid]
    assert np.all(np.diff(forces) >= 0.0)
    assert np.max(np.abs(np.diff(forces, 2))) < 0.1 * np.ptp(forces)


def test_it_is_constant_beyond_its_ends_and_vanishes_when_off(tmp_path: Path) -> None:
    """Nothing is extrapolated; at factor zero nothing is added; machine code does the same."""
    effect = law(tmp_path, DRAG)
    assert effect(0.02, 1.0) == numba.njit(effect.law)(0.02, 1.0)
    assert effect(9.0, 1.0) == pytest.approx(DRAG.curve[-1], rel=1e-5)
    assert effect(-9.0, 2.0) == pytest.approx(2.0 * DRAG.curve[0], rel=1e-5)
    assert effect(0.2, 0.0) == 0.0


def test_a_calibration_curve_is_an_effect_of_its_sensor(tmp_path: Path) -> None:
    """Its reading is off by the curve; no other sensor's is."""
    forces = (-900.0, -200.0, 0.0, 100.0, 300.0, 800.0)
    curve = tuple(25.0 * np.sin(x / 240.0) for x in forces)
    bent = Unexplained("reading of the load cell", "measured force", "N", forces, curve, "", 1e4)
    config, effect = added(tmp_path, bent), law(tmp_path, bent)
    assert [effect(x, 1.0) - x for x in forces] == pytest.approx(curve, rel=1e-4)
    factor = f"{effect.name}_factor"
    assert {n: s.get(factor, 0.0) for n, s in config.sensors.items() if s.get(factor)} == {
        "load_force": 1.0
    }


def test_a_second_table_gets_another_name() -> None:
    """A model that has one already can take a further one."""
    table_again = effect_table(DRAG, ["unexplained_friction_over_velocity"])
    assert table_again is not None
    assert table_again.name == "unexplained_friction_over_velocity_2"


@pytest.mark.parametrize(
    ("balance", "regressor"),
    [("force on the piston", "time"), ("leakage from a to b", "position times pressure difference"),
     ("flow into chamber a", "spool position"), ("reading of the load cell", "time")],
)  # fmt: skip
def test_what_has_no_place_in_the_model_is_not_added(balance: str, regressor: str) -> None:
    """A term over time, or in a balance whose stage does not know the regressor."""
    assert effect_table(Unexplained(balance, regressor, "N", SPEEDS, DRAG.curve, "", 1e4)) is None


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (lambda v: 90.0 * v, "odd in velocity, rising"),
        (lambda v: 90.0 * np.abs(v), "even in velocity"),
        (lambda v: 5.0 * (v > 0.05), "neither odd nor even in velocity, rising"),
        (lambda v: -90.0 * v, "odd in velocity, falling"),
    ],
)
def test_the_symmetry_of_a_curve_is_about_zero(curve: object, words: str) -> None:
    """Knots that lie unevenly about zero do not make an odd curve uneven."""
    knots = np.array(SPEEDS)
    assert words in in_words("velocity", knots, curve(knots), "N")  # type: ignore[operator]


@pytest.mark.full(sibling="test_the_law_goes_through_the_fitted_values")
def test_a_table_closes_the_gap_on_held_out_data(tmp_path: Path) -> None:
    """A leak that opens at 20 bar is in no catalogue: unknown, and mostly gone with its table."""
    train, held = campaign(
        Case("outside-crack", {"crack_leak": 3e-13}, wide=False, dirty=False, duration=2.0)
    )
    result = identify(knee(), train, held, Question(only=["transport_delay"]), cache=CACHE)
    assert result.verdict == "unknown_effect"
    assert result.unknown[0].balance == "leakage from a to b"
    assert result.added is not None
    (tmp_path / EFFECT_FILE).write_text(result.added.text)
    (tmp_path / "identified.toml").write_text(layer(result, [KNEE], "2026-01-01"))
    observer = Observer(PlantModel(load([KNEE, tmp_path / "identified.toml"]), CACHE), INSTRUMENTS)
    as_it_is = Fit([], np.zeros(0), np.zeros(0), np.zeros((0, 0)), 0.0)
    gap = measure(observer, compare(observer, as_it_is, as_it_is, train, held))
    for channel in ("pressure_a", "pressure_b", "position", "load_force"):
        before = result.gap[channel]["validation"]["free_before"]
        assert gap[channel]["validation"]["free_after"] < 0.7 * before
