"""No command destroys a file of the user: what exists is refused before the work."""

from collections.abc import Callable
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.command_line.kinds import Output
from hil_emulator.commands import init as init_command
from hil_emulator.commands.hide import PARTS, hide
from hil_emulator.commands.recording import RecordOptions, check_machine
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.panel.recorder import PanelRecorder
from hil_emulator.platform.packaged import packaged
from hil_emulator.platform.paths import shipped

RUN = "run hyq_knee --clock lockstep --duration 0.01s --record"
CONFORMANCE = "conformance --node 5 --eds missing.eds"

WRITTEN = [
    (f"{RUN} a.csv", "a.csv"),
    (f"{RUN} a.csv", "a.csv.rec"),
    (f"{RUN} a.rec", "a.rec"),
    (f"{RUN} a.blf", "a.dbc"),
    (f"{RUN} a.log", "a.log.json"),
    (f"{RUN} a.rec --record b.asc", "b.dbc"),
    ("convert run.rec a.csv", "a.csv"),
    ("convert run.rec a.mat b.log", "b.log.json"),
    ("plot run.rec", "run.png"),
    ("plot run.rec --picture a.svg", "a.svg"),
    ("demo", "hil-emulator-demo.png"),
    ("linear hyq_knee --picture a.png", "a.png"),
    ("experiment steps", "steps.csv"),
    ("experiment steps --out a.csv --picture a.png", "a.png"),
    ("experiment steps --out a.csv --scenario a.toml", "a.toml"),
    ("export hyq_knee --out net", "net/hydraulic_actuator_5.dcf"),
    ("export-fmu hyq_knee", "hyq_knee.fmu"),
    ("export-fmu hyq_knee --c-only --out a", "a.c"),
    ("init a.toml --yes", "a.toml"),
    ("init a.toml --yes", "a.eds"),
    ("init a.toml --yes", "hil-emulator.schema.json"),
    ("schema --out a.json", "a.json"),
    ("configs --copy hyq_leg", "hyq_supply.toml"),
    ("hide internal_leakage --out ground", "ground/truth.sealed"),
    ("hide internal_leakage --out ground", "ground/01_hyq_knee.toml"),
    ("identify hyq_knee log.csv --out found", "found/traces.npz"),
    ("identify hyq_knee log.csv --out found", "found/unexplained.py"),
    ("gap hyq_knee log.csv --out found", "found/result.json"),
    ("characterise force-poles hyq_knee --out bench", "bench/index.html"),
    ("characterise force-poles hyq_knee --out bench", "bench/force-poles.json"),
    ("scenario load_profile --html a.html", "a.html"),
    ("scenario load_profile --junit a.xml", "a.xml"),
    ("scenario load_profile --record runs", "runs/load_profile.csv"),
    (f"{CONFORMANCE} --html a.html", "a.html"),
]
"""Commands, and a file that each would write."""


def precious(file: Path) -> Callable[[], bool]:
    """Make a file that exists before the command; return a check that it is unchanged."""
    file.write_text("mine")
    return lambda: file.read_text() == "mine"


def dangling(file: Path) -> Callable[[], bool]:
    """Make a symbolic link to a file that does not exist, as `precious` does."""
    target = file.absolute().parents[2] / "outside"
    file.symlink_to(target)
    return lambda: file.is_symlink() and not target.exists()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder in which commands run."""
    here = tmp_path / "a" / "b"
    here.mkdir(parents=True)
    monkeypatch.chdir(here)
    return here


@pytest.mark.parametrize("made", [precious, dangling])
@pytest.mark.parametrize(("words", "name"), WRITTEN)
def test_a_file_of_the_user_is_kept(
    folder: Path, words: str, name: str, made: Callable[[Path], Callable[[], bool]]
) -> None:
    """The message names it and the remedy, the exit code is 2, and nothing else is written."""
    file = Path(name)
    file.parent.mkdir(exist_ok=True)
    as_it_was = made(file)
    before = sorted(folder.rglob("*"))
    result = CliRunner().invoke(main, words.split())
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert file.name in result.stderr
    way_out = "move it away" if name == "a.csv.rec" else "--overwrite"
    assert (way_out if made is precious else "choose another name") in result.stderr
    assert as_it_was()
    assert sorted(folder.rglob("*")) == before


def test_every_command_that_writes_can_overwrite() -> None:
    """The option is on each command that has an output, and on no other."""
    for name, command in main.commands.items():
        outputs = [p for p in command.params if isinstance(p.type, Output)]
        options = [p.name for p in command.params]
        assert bool(outputs) == ("overwrite" in options), name
    assert {words.split()[0] for words, _ in WRITTEN} == {
        name for name, c in main.commands.items() if any(p.name == "overwrite" for p in c.params)
    }


def test_every_path_that_is_written_is_declared_so() -> None:
    """An option of these names is never a plain path, which would not be protected."""
    written = {"out", "picture", "record", "junit", "page", "html", "targets", "file"}
    for name, command in main.commands.items():
        for p in command.params:
            if isinstance(p.type, click.Path) and p.name in written:
                assert isinstance(p.type, Output), f"{name} {p.name}"


@pytest.mark.parametrize(
    ("words", "name"),
    [("schema --out a.json", "a.json"), ("experiment steps --out a.csv", "a.csv"),
     ("export-fmu hyq_knee --c-only --out a", "a.c"), ("export hyq_knee --out .", "bus.dbc")],
)  # fmt: skip
def test_what_exists_is_replaced_on_request(folder: Path, words: str, name: str) -> None:
    """`--overwrite` behind the output or before it."""
    Path(name).write_text("mine")
    command, *rest = words.split()
    for order in ([command, "--overwrite", *rest], [command, *rest, "--overwrite"]):
        result = CliRunner().invoke(main, order)
        assert result.exit_code == 0, result.output
        assert Path(name).read_text(encoding="latin-1") != "mine"


def test_two_outputs_of_one_command_have_two_names(folder: Path) -> None:
    """The scenario would replace the stimulus file that it plays."""
    result = CliRunner().invoke(
        main, ["experiment", "steps", "--out", "a.toml", "--scenario", "a.toml"]
    )
    assert result.exit_code == 2
    assert "a.toml: named for two outputs" in result.stderr
    assert not list(folder.iterdir())


def test_a_failed_init_leaves_no_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After a machine that cannot be integrated, the next try starts in an empty folder."""

    def too_stiff(file: Path) -> float:
        assert file.with_suffix(".eds").is_file()
        raise UserError("so stiff")

    with monkeypatch.context() as failing:
        failing.setattr(init_command, "_step", too_stiff)
        with pytest.raises(UserError, match="so stiff"):
            init_command.init(Path("a.toml"), {}, ask=False)
    assert not list(folder.iterdir())
    monkeypatch.setattr(init_command, "_step", lambda _: 20e-6)
    init_command.init(Path("a.toml"), {}, ask=False)
    init_command.init(Path("b.toml"), {}, ask=False)  # both share the schema
    assert {f.name for f in folder.iterdir()} == {
        "a.toml", "a.eds", "b.toml", "b.eds", "hil-emulator.schema.json",
    }  # fmt: skip


def test_a_failed_hide_leaves_no_files(folder: Path) -> None:
    """The error for an unknown effect comes after the configuration was copied."""
    with pytest.raises(UserError, match="no_such_effect"):
        hide(["no_such_effect"], ["medium"], [], 1, False, 0.1, folder / "ground")
    assert not list(folder.iterdir())


def test_logs_of_another_practice_ground_are_not_mixed_in(folder: Path) -> None:
    """Not even with --overwrite: the next `identify` would take training/*.csv."""
    log = folder / "ground" / next(iter(PARTS)) / "09_mine.csv"
    log.parent.mkdir(parents=True)
    log.write_text("mine")
    with pytest.raises(UserError, match=r"09_mine\.csv: could be confused"):
        hide(["nothing"], ["medium"], [], 1, False, 0.1, folder / "ground", overwrite=True)


def test_each_actuator_of_a_machine_is_checked_before_the_run(folder: Path) -> None:
    """The second one's companion exists: the first one's recording is not begun."""
    settings = load_machine([shipped("configs/hyq_leg.toml")])
    Path("leg_knee.dbc").write_text("mine")
    with pytest.raises(UserError, match=r"leg_knee\.dbc: exists already"):
        check_machine(settings, RecordOptions([Path("leg.blf")]))


def test_two_scenarios_of_one_name_are_not_recorded_in_one_file(folder: Path) -> None:
    """The second would replace the first."""
    original = packaged()["load_profile"]
    result = CliRunner().invoke(
        main, ["scenario", str(original), f"{original.parent}/../scenarios/load_profile.toml",
               "--record", "runs"],
    )  # fmt: skip
    assert result.exit_code == 2
    assert "load_profile.rec: named for two outputs" in result.stderr


@pytest.mark.parametrize("made", [precious, dangling])
@pytest.mark.parametrize(
    ("wanted", "existing"),
    [("a.csv", "a.csv"), ("a.csv", "a.csv.rec"), ("a.blf", "a.dbc"), ("a.log", "a.log.json")],
)
def test_the_panel_records_over_nothing(
    folder: Path, wanted: str, existing: str, made: Callable[[Path], Callable[[], bool]]
) -> None:
    """It replaces neither a file nor its companions, and follows no link."""
    as_it_was = made(Path(existing))
    with pytest.raises(UserError, match=existing):
        PanelRecorder(Path(wanted), {"columns": {"time": "s"}})
    assert as_it_was()
    assert len(list(folder.iterdir())) == 1
