"""`hil-emulator linear`."""

import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.platform.paths import shipped

REFERENCE = str(shipped("configs/hyq_knee.toml"))


def linear(*arguments: str) -> tuple[int, str]:
    """Run the command; return exit code and output."""
    result = CliRunner().invoke(main, ["linear", REFERENCE, *arguments])
    return result.exit_code, result.output


def test_the_zeros_of_the_reference_machine_are_those_of_the_thesis() -> None:
    """-30 rad/s for the hydraulic and -10 rad/s for the load force (S1 Fig. 3.14)."""
    code, text = linear("--json")
    assert code == 0
    forms = json.loads(text)["forms"]["S1"]
    assert forms["hydraulic_force"]["zeros"] == [[pytest.approx(-30.0), 0.0]]
    assert forms["load_force"]["zeros"] == [[pytest.approx(-10.0), 0.0]]


def test_in_motion_the_exact_poles_are_near_the_analytic_ones() -> None:
    """At 1 mA the resonance of the compiled model is within 3 % of the complete form's."""
    _, text = linear("--json", "--current", "1 mA", "--position", "50 mm")

    def resonance(form: str) -> float:
        poles = json.loads(text)["forms"][form]["load_force"]["poles"]
        return min(math.hypot(re, im) for re, im in poles if im > 1.0)

    assert resonance("exact") == pytest.approx(resonance("complete"), rel=0.03)


def test_a_text_and_a_picture_for_people(tmp_path: Path) -> None:
    """Coefficients with units, poles with frequencies, and a frequency response."""
    picture = tmp_path / "response.png"
    code, text = linear("--picture", str(picture))
    assert code == 0
    assert "k_uv" in text
    assert "(60.6 Hz)" in text
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_position_outside_the_stroke_is_refused() -> None:
    """The message names the stroke."""
    code, text = linear("--position", "90 mm")
    assert code == 2
    assert "90 mm is outside the stroke of 80 mm" in text
