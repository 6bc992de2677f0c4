"""Messages and exit codes that a new user meets in the first minutes."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.command_line.examples import EXAMPLES
from hil_emulator.command_line.group import INTERRUPTED
from hil_emulator.commands.live import READY
from hil_emulator.commands.run import bus_settings
from hil_emulator.config.load import load
from hil_emulator.conformance.conftest import bus_settings as device_bus
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import spoken
from hil_emulator.platform.packaged import packaged
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.testing.report import report

pytest_plugins = ["pytester"]

KNEE = load([packaged()["hyq_knee"]])
START = bytes([1, 0])


def answer(*words: str) -> tuple[int, str]:
    """Return exit code and output of a command."""
    done = CliRunner().invoke(main, list(words))
    return done.exit_code, done.output


def test_ready_is_printed_after_the_first_frame() -> None:
    """In lock-step, one tick sends the boot-up message before "ready" is printed."""
    command = [sys.executable, "-m", "hil_emulator", "run", "hyq_knee", "--port", "0"]
    command += ["--clock", "lockstep", "--duration", "1 ms", "--fault", "supply droop"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert lines.index(READY) < lines.index(next(x for x in lines if x.startswith("frames")))
    assert "0 in, 1 out" in lines[-1]
    assert "fault     supply droop, drop 40 bar (usual)" in lines


def test_a_port_is_for_a_bus_that_listens() -> None:
    """`--port` replaces the configured port, and is refused for a bus without a TCP port."""
    assert bus_settings(KNEE, None, 4000)["port"] == 4000
    with pytest.raises(UserError, match="socketcan listens on no TCP port"):
        bus_settings(KNEE, "socketcan:vcan0", 4000)


def test_a_fault_reports_its_values_given_or_usual() -> None:
    """A value that is not given is marked as usual, in the unit of its channel."""
    assert spoken("supply droop").words == "supply droop, drop 40 bar (usual)"
    assert spoken("supply droop drop='60 bar' start='1 s'").words == (
        "supply droop, drop 60 bar, start 1 s"
    )
    assert spoken("pressure_a offset").words == "pressure_a offset, value 25 bar (usual)"
    code, output = answer("faults")
    assert code == 0
    assert "drop = 40 bar" in output


def test_a_set_point_reports_that_it_waits() -> None:
    """Before OPERATIONAL it waits for the NMT start, and is in force from then on."""
    from hil_emulator.bus.bus import Bus
    from hil_emulator.frame import Frame

    with Emulator(KNEE) as emulator, Bus(emulator.bus) as master:
        emulator.tick()
        with pytest.warns(RuntimeWarning, match="node 5 is PRE-OPERATIONAL; an NMT start"):
            emulator.set("valve_current", "1 mA")
        emulator.tick()
        assert emulator.signals.valve_current == 0.0
        master.send([Frame(0x000, START)])
        emulator.tick()
        assert emulator.signals.valve_current == pytest.approx(1e-3)
        assert emulator.rig.set("valve_current", 2e-3) == ""


def test_an_early_start_causes_a_warning() -> None:
    """A node receives no NMT command before its boot-up message: the emulator warns of one."""
    from hil_emulator.bus.bus import Bus
    from hil_emulator.frame import Frame

    with Emulator(KNEE) as emulator, Bus(emulator.bus) as master:
        master.send([Frame(0x000, START)])
        with pytest.warns(RuntimeWarning, match="before the first tick"):
            emulator.tick()


def test_a_fault_stays_in_the_report_of_a_failing_test(tmp_path: Path) -> None:
    """A `with` block has ended its fault when the test fails; the report has both moments."""
    with Emulator(KNEE) as emulator:
        with emulator.fault("pressure_a", "stuck"):
            emulator.run_for("3 ms")
        text = report(emulator, "test", tmp_path / "x.rec")
    assert "0.000 s  pressure_a stuck" in text
    assert "0.003 s  pressure_a stuck ended" in text


def test_a_marker_with_a_wrong_file_reports_the_searched_folder(
    pytester: pytest.Pytester,
) -> None:
    """The message for a missing file in the test's folder does not suggest an installation."""
    pytester.makepyfile("""
        import pytest
        @pytest.mark.emulator("nofile.toml")
        def test_x(emulator): pass
    """)
    output = pytester.runpytest_subprocess("-q").stdout.str()
    assert "nofile.toml: no such file next to the test" in output
    assert "install" not in output


def test_a_scenario_that_cannot_run_is_not_one_that_failed(tmp_path: Path) -> None:
    """The exit code is 2, and the message suggests the nearest key."""
    file = tmp_path / "s.toml"
    file.write_text(
        'title = "x"\nconfig = ["x.toml"]\nduraton = "1 s"\n[[step]]\nat = "1 s"\n'
        '[[expect]]\nsignal = "position"\nwithin = ["0 m", "1 m"]\nuntill = "1 s"\n'
    )
    code, output = answer("scenario", str(file), "--jobs", "1")
    assert code == 2
    assert "duraton: no such key, did you mean 'duration'" in output
    assert "expect.0.untill: no such key, did you mean 'until'" in output
    assert answer("scenario", str(tmp_path / "missing.toml"))[0] == 2


def test_conformance_uses_the_port_of_run_by_default() -> None:
    """Without options the suite connects to the port of `run`; options select another."""
    default = {p.name: p.default for p in main.commands["conformance"].params}["can"]
    assert device_bus(default, []) == {
        "interface": "socketcand", "channel": "can0", "host": "127.0.0.1",
        "port": KNEE.bus["port"],
    }  # fmt: skip
    assert device_bus("socketcand:can0", ["port=1234"])["port"] == 1234


def test_ctrl_c_ends_with_the_code_of_a_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    """The output is one word and the code 130, not "Aborted!" and the code of a failure."""

    def interrupted(*given: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("hil_emulator.commands.bench.bench", interrupted)
    code, output = answer("bench")
    assert code == INTERRUPTED
    assert output == "hil-emulator: interrupted\n"


def test_an_unexpected_end_of_data_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """The output is not "Aborted!", which click prints for it as for Ctrl-C."""

    def cut_off(*given: object) -> None:
        raise EOFError("Ran out of input")

    monkeypatch.setattr("hil_emulator.commands.bench.bench", cut_off)
    code, output = answer("bench")
    assert code == 2
    assert output.startswith("hil-emulator: data ended too early; a file was cut off")
    assert output.endswith("Ran out of input\n")


def test_effects_of_a_configuration_are_listed(tmp_path: Path) -> None:
    """The list has the catalogue and the effects of the configuration's files."""
    (tmp_path / "own.py").write_text(
        "from hil_emulator.model.declare import Param, effect\n"
        "from hil_emulator.model.stages import friction\n"
        "@effect(friction, knob=Param('level', 'N', 'force', 1.0, 0.0, 9.0), source='assumed',\n"
        "        signature='test')\n"
        "def own_drag(velocity: float, level: float) -> float:\n"
        "    'F = c v.'\n    return level * velocity\n\n\nEFFECTS = (own_drag,)\n"
    )
    (tmp_path / "own.toml").write_text('[model]\neffects = ["own.py"]\n')
    assert "own_drag" in answer("effects", "hyq_knee", str(tmp_path / "own.toml"))[1]
    assert "own_drag" not in answer("effects")[1]


def test_no_answer_has_its_exit_code(tmp_path: Path) -> None:
    """Data in which nothing moves cannot be examined: exit code 3."""
    time_s = np.arange(2000) * 1e-3
    rows = np.column_stack([time_s, np.zeros(2000), 1e-9 * np.sin(time_s)])
    file = tmp_path / "still.csv"
    np.savetxt(file, rows, delimiter=",", header="time [s],valve_current [A],position [m]",
               comments="")  # fmt: skip
    code, output = answer("gap", "hyq_knee", str(file))
    assert (code, "cannot_examine" in output) == (3, True), output


@pytest.mark.parametrize("name", sorted(main.commands))
def test_every_help_begins_with_an_example_that_is_understood(name: str) -> None:
    """The options of the example exist, and so do its packaged names."""
    example = EXAMPLES[name]
    assert answer(name, "--help")[1].partition("\n\n")[2].startswith(f"Example: {example}\n")
    if name != "completion":  # that one is evaluated by the shell
        _, command, *arguments = shlex.split(example)
        assert main.commands[command].make_context(command, arguments)


def test_the_list_of_commands_is_not_cut_off() -> None:
    """Each command is listed once by its whole first sentence, in a terminal of any width."""
    listed = answer("--help")[1].partition("Run and connect:")[2]
    assert "...\n" not in listed
    assert sorted(re.findall(r"^  (\S+)", listed, re.M)) == sorted(main.commands)


@pytest.mark.parametrize(
    ("words", "suggestion"),
    [
        (["rnu"], "run"),
        (["check", "hyq_kne"], "hyq_knee"),
        (["scenario", "hold_positon"], "hold_position"),
        (["run", "hyq_knee", "--trigger", "positon > 1 mm", "--record", "a.rec"], "position"),
        (["run", "hyq_knee", "--fault", "presure_a stuck"], "pressure_a"),
    ],
)
def test_a_wrong_name_gets_a_suggestion(words: list[str], suggestion: str) -> None:
    """It is given for a command, a machine, a scenario, a signal and a fault's target."""
    code, text = answer(*words)
    assert (code, f"did you mean '{suggestion}'?" in " ".join(text.split())) == (2, True), text


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_names(shell: str) -> None:
    """The script names the program, and its query returns the packaged machines."""
    assert "_HIL_EMULATOR_COMPLETE" in answer("completion", shell)[1]
    words = {"_HIL_EMULATOR_COMPLETE": "bash_complete", "COMP_WORDS": "hil-emulator run hyq_k",
             "COMP_CWORD": "2"}  # fmt: skip
    offered = CliRunner().invoke(main, [], env=words, prog_name="hil-emulator").output
    assert "plain,hyq_knee" in offered
