"""`hil-emulator identify` and `gap` on measured seals, as a user calls them."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.api import identification
from hil_emulator.config.load import load
from hil_emulator.identify.conclusion.result import Result

DATA = Path(__file__).parent / "data"
RIG = str(DATA / "friction_rig.toml")
TRAIN = [str(DATA / f"oring_{bar}bar.csv") for bar in (1, 5)]
CHECK = [f"--validate={DATA / f'oring_{bar}bar.csv'}" for bar in (3, 7)]


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder that `identify` has written."""
    folder = tmp_path_factory.mktemp("found")
    done = CliRunner().invoke(main, ["identify", RIG, *TRAIN, *CHECK, f"--out={folder}"])
    assert done.exit_code == 0, done.output
    return folder


def test_identify_writes_page_result_and_layer(identified: Path) -> None:
    """The layer it writes is accepted after the original; page and JSON agree."""
    result = json.loads((identified / "result.json").read_text())
    assert result["verdict"] == "missing_effects"
    force = result["effects"][0]["value"]
    assert result["effects"][0]["name"] == "coulomb_friction"
    assert result["held_out"] == ["oring_3bar.csv", "oring_7bar.csv"]
    assert (identified / "identified.toml").read_text().count(", held out") == 2
    layered = load([Path(RIG), identified / "identified.toml"])
    assert layered.plant["coulomb_friction_force"] == pytest.approx(force, rel=1e-6)
    page = (identified / "report.html").read_text()
    assert "coulomb_friction" in page
    assert page.count("data:image/png;base64") >= 4
    assert "http://" not in page


def test_a_page_that_fails_loses_no_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Result and layer are written before the page, and a failure of it is one line."""

    def fails(*_: object) -> str:
        raise IndexError("no column")

    monkeypatch.setattr(identification, "report", fails)
    done = CliRunner().invoke(main, ["gap", RIG, *TRAIN, f"--out={tmp_path}"])
    assert done.exit_code == 0, done.output
    assert done.output.count("report.html failed: IndexError: no column") == 1
    assert {f.name for f in tmp_path.iterdir()} == {
        "result.json", "identified.toml", "traces.npz",
    }  # fmt: skip


def test_the_layer_closes_the_gap(identified: Path) -> None:
    """Asked again with the layer, neither effect is missing any more."""
    layer = str(identified / "identified.toml")
    again = CliRunner().invoke(main, ["identify", RIG, layer, *TRAIN, *CHECK])
    assert "missing   " not in again.output


def test_gap_names_nothing() -> None:
    """`gap` measures; it does not name."""
    done = CliRunner().invoke(main, ["gap", RIG, *TRAIN])
    assert done.exit_code == 0, done.output
    assert "force on the piston" in done.output
    assert "missing   " not in done.output


@pytest.mark.parametrize(
    ("words", "training", "held"),
    [
        (
            ["c.toml", "a.csv", "b.csv", "--validate", "v.csv", "w.csv"],
            ["c.toml", "a.csv", "b.csv"],
            ["v.csv", "w.csv"],
        ),
        (
            ["--validate", "v.csv", "w.csv", "--out", "f", "c.toml", "a.csv"],
            ["c.toml", "a.csv"],
            ["v.csv", "w.csv"],
        ),
        (
            ["c.toml", "--validate=v.csv", "a.csv", "--validate", "w.csv", "x.csv"],
            ["c.toml", "a.csv"],
            ["v.csv", "w.csv", "x.csv"],
        ),
    ],
)
def test_held_out_data_go_up_to_the_next_option(
    words: list[str], training: list[str], held: list[str]
) -> None:
    """A pattern that the shell expands behind --validate stays out of the training data."""
    for name in ("identify", "gap"):
        parameters = main.commands[name].make_context(name, list(words)).params
        assert [str(f) for f in parameters["files"]] == training
        assert [str(f) for f in parameters["validate"]] == held


def test_a_configuration_is_no_held_out_data() -> None:
    """The message explains that --validate takes all files that follow."""
    done = CliRunner().invoke(main, ["identify", "--validate", "v.csv", RIG, *TRAIN])
    assert done.exit_code == 2
    assert "before it" in done.output


@pytest.mark.parametrize("rest", [[], ["--out", "f"]])
def test_held_out_data_have_to_be_named(rest: list[str]) -> None:
    """An option without a value is an error of usage."""
    done = CliRunner().invoke(main, ["identify", RIG, *TRAIN, "--validate", *rest])
    assert done.exit_code == 2
    assert "--validate" in done.output


def test_a_configuration_without_data_is_refused() -> None:
    """Without a recording there is one message and exit code 2."""
    done = CliRunner().invoke(main, ["identify", RIG])
    assert done.exit_code == 2
    assert "one recording" in done.output


def test_an_interrupted_search_ends_as_a_shell_expects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After Ctrl-C what is known is written, and the exit code is 130."""
    interrupted = Result("cannot_examine", "interrupted before the first round", interrupted=True)
    monkeypatch.setattr(identification.session, "identify", lambda *_, **__: interrupted)
    done = CliRunner().invoke(main, ["identify", RIG, *TRAIN, f"--out={tmp_path}"])
    assert done.exit_code == 130
    assert "interrupted" in done.output.lower()
    assert json.loads((tmp_path / "result.json").read_text())["interrupted"] is True
    assert "interrupted" in (tmp_path / "report.html").read_text().lower()
