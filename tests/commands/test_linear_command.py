"""`hil-emulator linear`."""

import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.platform.paths import shipped

REFERENCE = str(shipped("configs/hyq_knee.toml"))


MACHINES = ("hyq_knee", "test_axis", "press", "micro_rig", "excavator_boom")


def linear(*arguments: str, machine: str = REFERENCE) -> tuple[int, str]:
    """Run the command; return exit code and output."""
    result = CliRunner().invoke(main, ["linear", machine, *arguments])
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


@pytest.mark.parametrize("machine", MACHINES)
def test_every_packaged_machine_has_a_linear_model(machine: str) -> None:
    """Threshold and hysteresis hold the spool; the linear model has a spool that slides."""
    code, text = linear(machine=machine)
    assert code == 0
    assert ("Threshold and hysteresis: the spool slides" in text) == (machine != "hyq_knee")
    assert "S1: T. Boaventura" in text


def test_the_flow_gain_at_rest_is_shown_with_and_without_leaking_lands() -> None:
    """S1 eq. 3.23 has one edge, K_v sqrt(p_s - p_a); leaking lands add K_v sqrt(p_a - p_t)."""
    content = json.loads(linear("--json")[1])
    p_s, p_a, p_t = 160e5, content["operating_point"]["pressure_a"], 1e5
    gain = 7.5e-3 / 60.0 / (0.01 * math.sqrt(35e5))
    assert content["zero_lap"]["k_qa"] == pytest.approx(gain * math.sqrt(p_s - p_a), rel=1e-3)
    both = gain * (math.sqrt(p_s - p_a) + math.sqrt(p_a - p_t))
    assert content["coefficients"]["k_qa"] == pytest.approx(both, rel=1e-3)


def test_a_dead_band_is_left_out_at_rest_and_kept_in_motion(tmp_path: Path) -> None:
    """At rest the model is that of the band's edges; a current within the band moves nothing."""
    lap = tmp_path / "lap.toml"
    lap.write_text('[valve]\noverlap = "2 mA"\n', encoding="utf-8")
    rest = json.loads(linear("--json", str(lap))[1])
    assert "Within ±2 mA only leakage" in rest["left_out"][0]
    assert rest["coefficients"]["k_qa"] > 0.0
    driver = tmp_path / "driver.toml"
    driver.write_text(
        '[driver]\ndead_band_compensation = "20 %"\ndither = "1 %"\nspool_feedback = "5 Hz"\n'
        'ramp = "0.1 A/s"\n',
        encoding="utf-8",
    )
    driven = json.loads(linear("--json", str(lap), str(driver))[1])
    assert driven["left_out"][0] == "Dither: the model is that of the mean current."
    assert driven["coefficients"]["k_qa"] == pytest.approx(rest["coefficients"]["k_qa"])
    code, text = linear(str(lap), "--current", "1.5 mA")
    assert code == 2
    assert "within the dead band of ±2 mA" in text
    moving = json.loads(linear("--json", str(lap), "--current", "3 mA")[1])
    assert moving["operating_point"]["velocity"] > 0.0
    assert moving["left_out"] == []


def test_a_number_that_rests_on_a_default_is_marked(tmp_path: Path) -> None:
    """Leakage through the lands is laminar: its pole depends on the edges' Reynolds number.

    A file with the number removes the mark; flow gain and stiffness depend on no default.
    """
    field = "valve_critical_reynolds_number"
    marks = json.loads(linear("--json")[1])["rests_on_assumed"]
    assert any(field in fields for name, fields in marks.items() if name.startswith("exact pole"))
    assert not {"k_qa", "k_xp"} & marks.keys()
    assert "rests on an assumed valve_critical" in linear()[1]
    file = tmp_path / "stated.toml"
    file.write_text("[valve]\ncritical_reynolds_number = 14.7\n", encoding="utf-8")
    stated = json.loads(linear("--json", str(file))[1])["rests_on_assumed"]
    assert not any(field in fields for fields in stated.values())


def test_a_spool_of_two_to_one_has_half_the_gain_at_port_b(tmp_path: Path) -> None:
    """At the edges of the dead band, whose edges all open at the same travel."""
    file = tmp_path / "unlike.toml"
    unlike = 'gain_sb = "-50 %"\ngain_bt = "-50 %"\nlap_sb = "-20 %"\nlap_bt = "-20 %"\n'
    file.write_text(f'[valve]\noverlap = "20 %"\n{unlike}', encoding="utf-8")
    content = json.loads(linear("--json", str(file))[1])
    # at rest only leakage passes: far more would if an edge were open at null by its lap
    at, k = content["operating_point"], content["zero_lap"]
    assert at["supply_flow"] < 1e-6
    roots = math.sqrt(at["pressure_b"] - 1e5), math.sqrt(160e5 - at["pressure_a"])
    assert k["k_qb"] / k["k_qa"] == pytest.approx(0.5 * roots[0] / roots[1], rel=1e-3)
