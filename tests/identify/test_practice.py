"""The practice folder: hidden effects, their logs, and the comparison after opening."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.experiment_design import practice, sealed
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.simulation.node_factory import nodes
from tests.identify.rig_data import knee_model
from tests.studies.generator import cases
from tests.studies.generator.bench import record


def output_of(*words: object) -> str:
    """Run a command that has to succeed, and return its output."""
    result = CliRunner().invoke(main, [str(w) for w in words])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a practice ground with leakage hidden in it."""
    folder = tmp_path_factory.mktemp("practice") / "ground"
    output_of("hide", "internal_leakage", "--duration", "1 s", "--seed", "5", "--out", folder)
    return folder


def test_it_looks_like_a_measurement(ground: Path) -> None:
    """Logger files in engineering units, with the names that identification reads."""
    files = sorted((ground / "training").glob("*.csv"))
    assert [f.stem[3:] for f in files] == list(practice.TRAINING)
    assert len(list((ground / "validation").glob("*.csv"))) == len(practice.VALIDATION)
    assert "pressure_a [bar]" in files[0].read_text().splitlines()[0]
    for e in load_experiments(files):
        assert set(e.readings) == set(practice.INSTRUMENTS)
        assert not e.notes


def test_the_plain_configuration_stands_alone(ground: Path) -> None:
    """The copy loads with its EDS, and does not contain the hidden effects."""
    (file,) = ground.glob("*.toml")
    config = load([file])
    assert "internal_leakage_conductance" not in config.plant
    assert nodes(config, knee_model().names)


def test_the_truth_is_not_readable_at_a_glance(ground: Path) -> None:
    """Neither name nor number stands in the sealed file, and the digest printed is the file's."""
    text = (ground / sealed.NAME).read_text()
    assert "leakage" not in text
    assert sealed.unseal(ground)["effects"][0]["name"] == "internal_leakage"


def test_opening_compares_truth_and_verdict(ground: Path) -> None:
    """With a result, opening lists the named, missed and wrong effects."""
    assert "no result yet" in output_of("hide", "--open", ground)
    (ground / "found").mkdir(exist_ok=True)
    named = {"name": "internal_leakage", "value": 1.6e-13, "interval": [1.5e-13, 1.65e-13],
             "group": []}  # fmt: skip
    other = {"name": "gravity", "value": 5.0, "interval": [1.0, 9.0], "group": []}
    result = {"verdict": "missing_effects", "effects": [named, other], "reason": "", "gap": {}}
    result["gap_measure"] = "N"
    (ground / "found" / "result.json").write_text(json.dumps(result))
    output = output_of("hide", "--open", ground)
    assert "hidden    internal_leakage: conductance = 1.7e-13" in output
    assert "5.9 % off; the truth is outside its 95 %" in output
    assert "wrong     gravity is named and not hidden" in output


@pytest.mark.parametrize(
    ("group", "words"),
    [(["internal_leakage"], "in group  internal_leakage with"), ([], "missed    internal")],
)
def test_a_group_is_not_a_miss(group: list[str], words: str) -> None:
    """A group that contains the truth is not a wrong name."""
    truth = {"effects": [{"name": "internal_leakage", "value": 1.0, "unit": "1"}]}
    effect = {"name": "external_leakage", "value": 1.0, "interval": [0.0, 2.0], "group": group}
    assert any(line.startswith(words) for line in sealed.compared(truth, {"effects": [effect]}))


def test_another_experiment_can_be_recorded_there(ground: Path, tmp_path: Path) -> None:
    """The hidden machine follows a stimulus file, and its recording joins the training data."""
    file = tmp_path / "more.csv"
    output_of("experiment", "triangles", "--duration", "1 s", "--out", file)
    output_of("hide", "--play", file, "--out", ground)
    (made,) = load_experiments([ground / "training" / "05_more.csv"])
    wanted = np.loadtxt(file, delimiter=",", skiprows=1)[:, 1]
    assert np.corrcoef(made.readings["position"], wanted)[0, 1] > 0.98


def test_the_same_seed_makes_the_same_machine(tmp_path: Path) -> None:
    """Every file is the same again; another seed makes another machine."""
    texts = []
    for i, seed in enumerate((1, 1, 2)):
        output_of(
            "hide", "nothing", "--duration", "0.8 s", "--seed", seed, "--out", tmp_path / str(i)
        )
        texts.append((tmp_path / str(i) / "training" / "01_multisine.csv").read_text())
    assert texts[0] == texts[1] != texts[2]


def test_what_is_hidden_acts() -> None:
    """With the same seed, the leak makes the valve work harder at rest than in its absence."""
    model = knee_model()
    healthy = practice.ground(model, [], 3)
    leaking = practice.ground(model, [practice.hide(model, "internal_leakage", "large")], 3)
    (before,), (after,) = (practice.campaign(g, ["micro_motion"]) for g in (healthy, leaking))
    assert abs(np.mean(after.current)) > abs(np.mean(before.current)) + 1e-5


def test_ordinary_parameters_deviate_within_their_tolerance() -> None:
    """Seeds give different values, within one standard deviation."""
    model = knee_model()
    drawn = [practice.ground(model, [], seed).ordinary for seed in range(20)]
    assert set(drawn[0]) == {c.name for c in parameters.ordinary(model)}
    values = np.array([list(d.values()) for d in drawn])
    assert np.abs(values).max() <= practice.PARAMETER_DEVIATION
    assert values.std(axis=0).min() > 0.2


@pytest.mark.parametrize(
    ("name", "size", "message"),
    [
        ("internal_leak", "small", "cannot be hidden"),
        ("offset", "small", "did you mean load_force.offset or position.offset"),
        ("coulomb_friction", "small", "cannot be hidden"),
        ("gravity", "3 bar", "take small, medium or large, or a"),
        ("gravity", "1e9 N", "is outside .* ... 1e"),
    ],
)
def test_what_cannot_be_hidden_is_refused(name: str, size: str, message: str) -> None:
    """An unknown effect, one without its channel, one that is configured, a wrong size."""
    with pytest.raises(UserError, match=message):
        practice.hide(knee_model(), name, size)


@pytest.mark.parametrize(("size", "value"), [("60 N", 60.0), ("small", 70.0), ("large", 500.0)])
def test_a_size_is_a_word_or_a_value(size: str, value: float) -> None:
    """Words are parts of the typical size of 200 N; a value stands for itself."""
    assert practice.hide(knee_model(), "gravity", size).value == pytest.approx(value)


def test_contradictory_options_are_refused(tmp_path: Path) -> None:
    """Neither an effect nor --surprise, or a folder that is in use, ends with exit code 2."""
    nothing = CliRunner().invoke(main, ["hide", f"--out={tmp_path / 'a'}"])
    assert (nothing.exit_code, "--surprise" in nothing.output) == (2, True)
    (tmp_path / sealed.NAME).write_text("#")
    used = CliRunner().invoke(main, ["hide", "gravity", f"--out={tmp_path}"])
    assert (used.exit_code, "truth.sealed: exists already" in used.output) == (2, True)
    broken = CliRunner().invoke(main, ["hide", f"--open={tmp_path}"])
    assert (broken.exit_code, "is broken" in broken.output) == (2, True)


@pytest.mark.slow
def test_a_surprise_is_found(tmp_path: Path) -> None:
    """The commands as printed: hide, identify, open - and the drawn effect has its name."""
    out = tmp_path / "s"
    output = output_of("hide", "--surprise", "--seed", "6", "--out", out)
    assert "hidden" not in output
    held = [f"--validate={f}" for f in sorted((out / "validation").glob("*.csv"))]
    training = sorted((out / "training").glob("*.csv"))
    output_of("identify", *out.glob("*.toml"), *training, *held, f"--out={out / 'found'}")
    opened = output_of("hide", "--open", out)
    assert "named     " in opened or "in group  " in opened
    assert "missed" not in opened


def test_a_chirp_is_no_drift_of_a_clock() -> None:
    """Friction makes the rod's lag behind the pressures fall as the chirp gets faster."""
    leak = practice.hide(knee_model(), "internal_leakage", "medium")
    made = practice.ground(knee_model(), [leak], 1)
    assert contradictions(practice.campaign(made, ["chirp"]), knee_model().plant_values) == []


def test_steps_of_a_healthy_rod_are_on_one_clock() -> None:
    """Its lag behind the valve changes by 5 ms with the motion; a clock 3 % faster shows."""
    made = cases.case("small", 16, 2.0)
    steps = record(
        cases.machine(made), dict(made.effects), "steps", (cases.seed(made.name), 1), 2.0, False
    )
    assert contradictions([steps], knee_model().plant_values) == []
    rod = steps.readings["position"]
    later = np.interp(1.03 * np.arange(len(rod)), np.arange(len(rod)), rod)
    faster = replace(steps, readings={**steps.readings, "position": later})
    assert "two clocks" in contradictions([faster], knee_model().plant_values)[0]
