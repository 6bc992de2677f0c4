"""Numbers that depend on defaults: values missing in the files, varied by their usual spread."""

from pathlib import Path

import pytest

from hil_emulator.config.assumed import moved_defaults
from hil_emulator.config.load import load
from hil_emulator.model.rests_on import rests_on
from hil_emulator.platform.paths import shipped

REFERENCE = shipped("configs/hyq_knee.toml")


def test_defaults_move_by_their_spread_and_stated_values_stay(tmp_path: Path) -> None:
    """Twice the viscosity and three times the Reynolds number; what a file states does not move."""
    moved = moved_defaults(load([REFERENCE]))
    assert moved["oil_kinematic_viscosity"] == pytest.approx(2 * 46e-6)
    assert moved["valve_critical_reynolds_number"] == pytest.approx(3 * 14.7)
    assert "load_mass" not in moved  # stated
    assert "valve_laminar_width" not in moved  # a setting
    assert "hysteresis_transition" not in moved  # of an effect that is off
    file = tmp_path / "stated.toml"
    text = '[valve]\ncritical_reynolds_number = 20\nhysteresis = "3 %"\nrated_current = "1.6 A"\n'
    file.write_text(text + 'current_saturation = "100 %"\nspool_rate_limit = "500 A/s"\n')
    moved = moved_defaults(load([REFERENCE, file]))
    assert "valve_critical_reynolds_number" not in moved
    assert moved["hysteresis_transition"] == pytest.approx(2 * 0.02 * 1.6)
    assert moved["valve_slot_per_ampere"] == pytest.approx(2 * 0.25e-3 / 1.6)


def test_a_number_rests_on_what_moves_it_by_more_than_a_tenth() -> None:
    """11 % count, 9 % do not; infinite numbers and those that a model lacks are ignored."""
    numbers = {"gain": 100.0, "pole": -10.0, "still": 0.0, "sensitivity": float("inf")}
    others = {
        "viscosity": {"gain": 109.0, "pole": -11.1, "still": 0.0, "sensitivity": 1.0},
        "slot": {"gain": 88.0},
    }
    assert rests_on(numbers, others) == {"gain": ("slot",), "pole": ("viscosity",)}
