"""Words of a result."""

import math
from pathlib import Path

import pytest

from hil_emulator.config.datasheet import SheetQuantity
from hil_emulator.config.load import load
from hil_emulator.identify.conclusion import wrong_values
from hil_emulator.identify.conclusion.findings import Finding, Refitted
from hil_emulator.identify.experiment_design.next_experiment import Candidate, NextExperiment
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.platform.paths import shipped
from tests.identify.rig_data import INSTRUMENTS, knee_model


def finding(group: tuple[str, ...] = (), form: str = "") -> Finding:
    """Return an effect that was found."""
    return Finding(
        "fixed_pump", "flow", 1e-4, "m^3/s", "l/min", (0.9e-4, 1.1e-4), 0.9, 700.0, 500.0, group,
        bool(form), (), form=form,
    )  # fmt: skip


def test_one_effect_is_reported_with_value_and_interval() -> None:
    """Units are those of the workshop."""
    assert str(finding()) == "fixed_pump: flow = 6 l/min (95 %: 5.4 l/min ... 6.6 l/min)"


def test_a_finding_names_its_rivals_and_another_form_of_its_law() -> None:
    """The first sentence has both."""
    words = str(finding(("variable_pump",), "its override would have to be the lowest there is"))
    head = "fixed_pump or variable_pump, by a law of another form: flow of fixed_pump = 6 l/min"
    assert words.startswith(head)


def test_an_experiment_is_recommended_for_what_looks_alike_or_fits_as_badly() -> None:
    """If the data separate all laws well, the law of the machine is another one."""

    def recommended(now: float, *rivals: str) -> str:
        best = Candidate("chirp", 5e-3, 2.0, 100.0)
        return str(NextExperiment(("fixed_pump", *rivals), now, best, (), "do it"))

    assert recommended(3.0, "variable_pump").startswith(
        "fixed_pump and variable_pump look alike here"
    )
    assert recommended(90.0, "variable_pump", "x").startswith(
        "the machine's law is not exactly that of fixed_pump or variable_pump or x; record chirp at"
    )


def test_an_undecided_verdict_states_both_explanations_and_what_separates_them() -> None:
    """Another mass, or an effect that hides it: the mass can be weighed, the effect varied."""
    effects = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}
    mass = next(c for c in parameters.ordinary(knee_model()) if c.name == "load_mass")
    value = Refitted(50.0, 65.2, 64.8, 65.6, "kg", "kg")
    far, rivals = [(mass, 0.3)], [effects["load_coulomb_friction"]]
    (words,) = wrong_values.in_words(far, {"load_mass": value})
    name = wrong_values.names(far, {"load_mass": value})
    assert wrong_values.competing([words], name, rivals) == (
        "two explanations fit: load_mass = 65.2 kg (95 %: 64.8 kg ... 65.6 kg), not 50 kg, with no "
        "effect missing; or load_coulomb_friction is missing, with load_mass nearer to its "
        "configured value"
    )
    assert wrong_values.separating(name, rivals) == (
        "measure load_mass directly, or record at other speeds, slower and faster"
    )


def test_a_wrong_value_is_stated_as_its_data_sheet_does() -> None:
    """The valve's gain as nominal flow, the piston's area as bore; a stated gain as gain."""
    sheet = load([shipped("configs/hyq_knee.toml")]).sheet
    gain = next(c for c in parameters.ordinary(knee_model()) if c.name == "valve_gain")
    value = Refitted(gain.neutral, 0.8 * gain.neutral, 0.7 * gain.neutral, 0.9 * gain.neutral,
                     gain.unit, gain.shown, sheet[gain.field])  # fmt: skip
    assert wrong_values.in_words([(gain, -0.2)], {"valve_gain": value}) == [
        "nominal_flow = 6 l/min (95 %: 5.25 l/min ... 6.75 l/min), not 7.5 l/min"
    ]
    assert wrong_values.names([(gain, -0.2)], {"valve_gain": value}) == "nominal_flow"
    assert value.change == pytest.approx(-0.2)
    area = math.pi * 0.02**2
    bore = SheetQuantity("bore", "m", "mm", math.sqrt(4.0 / math.pi), 0.5)
    wider = Refitted(area, 1.21 * area, 1.2 * area, 1.22 * area, "m^2", "cm^2", bore)
    assert (wider.words(wider.refitted), wider.change) == ("44 mm", pytest.approx(0.1))


def test_only_what_a_file_states_by_a_data_sheet_is_shown_so(tmp_path: Path) -> None:
    """A gain, and a piston area, are their own quantities; a bore is a diameter of 40 mm."""
    layer = tmp_path / "layer.toml"
    layer.write_text(
        '[valve]\ngain = "7e-6 m^3/(s*A*Pa^0.5)"\n[cylinder]\nbore = "40 mm"\nrod = "28 mm"'
    )
    config = load([shipped("configs/hyq_knee.toml"), layer])
    assert config.sheet.keys() == {"cylinder_piston_area"}
    of = config.sheet["cylinder_piston_area"].of
    assert of(config.plant["cylinder_piston_area"]) == pytest.approx(0.04)
