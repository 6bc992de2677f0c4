"""Words of a result."""

from hil_emulator.identify.conclusion import wrong_values
from hil_emulator.identify.conclusion.findings import Finding, Refitted
from hil_emulator.identify.experiment_design.next_experiment import Candidate, NextExperiment
from hil_emulator.identify.prediction.plant import parameters
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
    assert wrong_values.competing([words], far, rivals) == (
        "two explanations fit: load_mass = 65.2 kg (95 %: 64.8 kg ... 65.6 kg), not 50 kg, with no "
        "effect missing; or load_coulomb_friction is missing, with load_mass nearer to its "
        "configured value"
    )
    assert wrong_values.separating(far, rivals) == (
        "measure load_mass directly, or record at other speeds, slower and faster"
    )
