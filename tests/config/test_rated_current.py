"""Currents of a valve as shares of its rated current, and bounds relative to it."""

import math
from pathlib import Path

import pytest

from hil_emulator.config.load import Configuration, load
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped

SOLENOID = """
nominal_flow = "40 l/min"
rated_current = "1.6 A"
pressure_drop_per_edge = "5 bar"
current_saturation = "100 %"
"""


def loaded(folder: Path, text: str) -> Configuration:
    """Return the reference machine with lines of its valve replaced."""
    file = folder / "valve.toml"
    file.write_text(f"[valve]\n{text}", encoding="utf-8")
    return load([shipped("configs/hyq_knee.toml"), file])


@pytest.mark.parametrize("share", [False, True])
def test_a_solenoid_is_written_in_shares_or_in_amperes(tmp_path: Path, share: bool) -> None:
    """4 % hysteresis and 25 % dead band of 1.6 A are 64 mA and 0.4 A."""
    sizes = ("4 %", "25 %", "-3 %") if share else ("64 mA", "0.4 A", "-48 mA")
    keys = zip(("hysteresis", "overlap", "null_bias"), sizes, strict=True)
    lines = "\n".join(f'{key} = "{size}"' for key, size in keys)
    plant = loaded(tmp_path, SOLENOID + lines).plant
    assert plant["hysteresis_width"] == pytest.approx(0.064)
    assert plant["overlap_lap"] == pytest.approx(0.4)
    assert plant["null_bias_bias"] == pytest.approx(-0.048)


def test_bounds_are_shares_of_the_rated_current(tmp_path: Path) -> None:
    """0.5 A of hysteresis is refused for 1.6 A and for 10 mA; 0.2 A for 10 mA only."""
    loaded(tmp_path, SOLENOID + 'hysteresis = "0.2 A"')
    with pytest.raises(UserError, match=r"outside the allowed 0 mA \.\.\. 320 mA.* of 1600 mA"):
        loaded(tmp_path, SOLENOID + 'hysteresis = "0.5 A"')
    with pytest.raises(UserError, match=r"outside the allowed 0 mA \.\.\. 2 mA.* of 10 mA"):
        loaded(tmp_path, 'hysteresis = "0.2 A"')


def test_defaults_follow_the_rated_current(tmp_path: Path) -> None:
    """A slot of 0.25 mm at full opening, and a loop that changes sides within 2 %."""
    plant = loaded(tmp_path, SOLENOID + 'hysteresis = "4 %"').plant
    assert plant["valve_slot_per_ampere"] * 1.6 == pytest.approx(0.25e-3)
    assert plant["hysteresis_transition"] == pytest.approx(0.02 * 1.6)
    stated = loaded(tmp_path, SOLENOID + 'slot_per_ampere = "0.001 m/A"').plant
    assert stated["valve_slot_per_ampere"] == 0.001


def test_a_share_without_a_rated_current_is_refused(tmp_path: Path) -> None:
    """A valve given by its gain has the driver's limit as its rated current, or no shares."""
    file = tmp_path / "gain.toml"
    text = '[valve]\ngain = "6.68e-6 m^3/(s*A*Pa^0.5)"\noverlap = "20 %"\n'
    file.write_text(text + 'current_saturation = "20 mA"\n', encoding="utf-8")
    reference = shipped("configs/hyq_knee.toml")
    assert load([reference, file]).plant["overlap_lap"] == pytest.approx(4e-3)
    file.write_text(text + 'current_saturation = "off"\n', encoding="utf-8")
    with pytest.raises(UserError, match="a share of the rated current; give rated_current"):
        load([reference, file])


@pytest.mark.parametrize(("passage", "narrowed"), [("off", 1.0), ("1.2 A", 1.0 / math.sqrt(2.0))])
def test_a_sheets_flow_is_that_of_full_command(
    tmp_path: Path, passage: str, narrowed: float
) -> None:
    """Of 1.6 A an overlap of 25 % leaves an opening of 1.2 A, which passes the nominal flow.

    A passage that resists as much as the edge at 1.2 A narrows that opening by the root of two.
    """
    text = SOLENOID + f'overlap = "25 %"\nflow_saturation = "{passage}"'
    gain = loaded(tmp_path, text).plant["valve_gain"]
    assert gain * 1.2 * narrowed * math.sqrt(5e5) == pytest.approx(40e-3 / 60)
