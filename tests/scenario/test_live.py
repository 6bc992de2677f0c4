"""The same scenario against a controller on a bus, in Python, and with the reference controller."""

import re
import shlex
import shutil
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import can
import pytest
from test_shown import PAGES, block

import hil_emulator as hil
from hil_emulator.bus.bus import Bus
from hil_emulator.bus.opening import open_can_bus
from hil_emulator.commands.live_play import LivePlay, ScenarioOver
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.panel.play import play as play_on_panel
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.scenario.loading import load as load_scenario
from hil_emulator.scenario.loading import runs_of
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.simulation.assembly import assemble

HOLD = shipped("configs/scenarios/hold_position.toml")


def proportional(bus: Any, gain: float = 0.1) -> Callable[[], None]:
    """Return a controller of the position, to be called after each tick."""

    def send(identifier: int, data: bytes) -> None:
        bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def step() -> None:
        while (message := bus.recv(0)) is not None:
            if message.arbitration_id == 0x705:
                send(0x000, bytes([1, 5]))
            elif message.arbitration_id == 0x285:
                position = struct.unpack_from("<i", message.data)[0] * 1e-7
                send(0x205, struct.pack("<i", round(1e9 * gain * (0.05 - position))))

    return step


def connect(gain: float) -> Callable[[Any], Callable[[], object]]:
    """Return what connects such a controller to a rig."""

    def connected(rig: Any) -> Callable[[], object]:
        bus = can.Bus(**rig.bus)
        rig.every_tick(proportional(bus, gain))
        return bus.shutdown

    return connected


def verdicts(outcome: Outcome) -> str:
    """Return the verdict on each expectation."""
    return "".join("+" if c.passed else "-" for c in outcome.checks)


@pytest.mark.parametrize(("gain", "expected"), [(0.1, "++++"), (0.01, "--++")])
def test_a_controller_in_python_passes_or_fails(gain: float, expected: str) -> None:
    """In lock-step; one whose gain is too low does not reach its target in time."""
    (outcome,) = hil.play(HOLD, connect(gain))
    assert verdicts(outcome) == expected
    assert outcome.events[0] == (0.0, "position 50 mm (left to your controller)")


def test_the_fixture_fails_a_test_with_what_was_missed(play_scenario: Any) -> None:
    """The message has the expectation and what was observed."""
    (outcome,) = play_scenario(HOLD, connect(0.1))
    assert outcome.passed
    with pytest.raises(
        pytest.fail.Exception, match=r"by 0\.8 s for 0\.1 s: never, last 45\.\d+ mm"
    ):
        play_scenario(HOLD, connect(0.01))


def test_a_controller_is_needed() -> None:
    """In lock-step there is no controller unless one is connected: three ways out are named."""
    with pytest.raises(UserError, match=r"run --scenario .*hil.play.*--controller reference"):
        hil.play(HOLD)


@contextmanager
def live(file: Path, role: Any, channel: str) -> Iterator[tuple[LivePlay, can.BusABC]]:
    """Yield a scenario on a rig that others reach by a bus, and the bus of a controller."""
    settings = {"interface": "virtual", "channel": channel}
    play = LivePlay(file, load_scenario(file), role)
    with Bus(settings) as bus:
        rig = assemble(load([shipped("configs/hyq_knee.toml")]), play.port(bus), cache_folder())
        play.start(rig)
        theirs = open_can_bus(settings)
        yield play, theirs
        theirs.shutdown()


def run(play: LivePlay, after_tick: Callable[[], None]) -> str:
    """Let a scenario pass; return why it ended early, "" if it did not."""
    try:
        while True:
            play.step()
            after_tick()
    except ScenarioOver:
        return ""
    except UserError as error:
        return str(error)


def test_a_controller_on_the_bus_is_awaited_and_judged(capfd: pytest.CaptureFixture[str]) -> None:
    """It comes 30 ms late: the time of the scenario begins with its first set point."""
    with live(HOLD, "external", "late controller") as (play, bus):
        control = proportional(bus)

        def after_tick() -> None:
            if play.now_ns == 30_000_000:
                bus.send(can.Message(arbitration_id=0, data=[1, 5], is_extended_id=False))
            elif play.now_ns > 30_000_000:
                control()

        outcome = play.outcome(run(play, after_tick))
        assert (verdicts(outcome), outcome.error) == ("++++", "")
        assert play.now_ns > 2_030_000_000
    printed = capfd.readouterr().out
    assert "waits     for a controller, 30 s at most" in printed
    assert re.search(r"1\.000 s  step    supply droop\n", printed)
    assert printed.count("  met     ") == 4


def test_the_wait_for_a_controller_ends(tmp_path: Path) -> None:
    """The message describes what a controller has to do, and what the nodes are."""
    text = HOLD.read_text().replace('"../hyq', f'"{shipped("configs/hyq_knee.toml").parent}/hyq')
    (tmp_path / "short.toml").write_text('patience = "20 ms"\n' + text)
    with live(tmp_path / "short.toml", "external", "no controller") as (play, _):
        error = run(play, lambda: None)
        assert re.search(r"no controller within 0\.02 s.*node 5 is pre-operational", error)
        assert play.outcome(error).error == error


def test_the_command_plays_it_on_a_bus_and_reports(tmp_path: Path) -> None:
    """With the reference controller, whose frames are on the bus: exit code, reports, recording."""
    command = [sys.executable, "-m", "hil_emulator", "run", "--scenario", "hold_position"]
    command += ["--controller", "reference", "--clock", "lockstep", "--port", "0"]
    command += ["--junit", "r.xml", "--html", "r.html", "--record", "r.rec"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"0\.\d+ s  met     model\.position in 49\.5 mm", done.stdout)
    assert "pass     The controller holds 50 mm  4/4" in done.stdout
    assert ElementTree.parse(tmp_path / "r.xml").getroot().get("tests") == "1"
    assert "data:image/png;base64," in (tmp_path / "r.html").read_text()
    assert (tmp_path / "r.rec").stat().st_size > 100_000


BUS_OPTIONS = [
    (["--duration", "1 s"], "the scenario has its own duration"),
    (["--controller", "external", "--port", "0"], 'controller = "off" silences the reference'),
]


@pytest.mark.parametrize(("options", "message"), BUS_OPTIONS)
def test_what_a_scenario_cannot_be_played_with_is_refused(options: list[str], message: str) -> None:
    """Before the run, with exit code 2."""
    command = [sys.executable, "-m", "hil_emulator", "run", "--scenario", "lost_set_points"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert message in done.stderr


STEP = """
title = "Pressure"
config = ["{config}"]
duration = "30 ms"
controller = "none"
repeat = 2

[sweep]
pressure = ["100 bar", "120 bar"]

[[step]]
name = "change"
at = "10 ms"
nmt = "start"
set = {{ supply_pressure = "{{pressure}}" }}
send = ["0x301 01 02", "0x18FF1234"]

[[expect]]
signal = "supply_pressure"
within = ["99 bar", "101 bar"]
by = "5 ms"
after = "change"

[[expect]]
object = "0x1000"
within = [0x198, 0x198]

[[expect]]
frame = "node5.tpdo1"
after = "change"
by = "5 ms"

[[expect]]
frame = "0x301"
data = "0102"
from = "10 ms"
"""


@pytest.fixture
def swept(tmp_path: Path) -> Path:
    """Return a scenario of four runs."""
    file = tmp_path / "swept.toml"
    file.write_text(STEP.format(config=shipped("configs/hyq_knee.toml")))
    return file


def test_a_scenario_sweeps_values_and_repeats_with_seeds(swept: Path) -> None:
    """Each combination is a run of its own; the values are in its title and in its texts."""
    runs = {o.title: verdicts(o) for o in hil.play(swept)}
    assert runs == {
        "Pressure (pressure 100 bar, seed 1)": "++++",
        "Pressure (pressure 100 bar, seed 2)": "++++",
        "Pressure (pressure 120 bar, seed 1)": "-+++",
        "Pressure (pressure 120 bar, seed 2)": "-+++",
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{pressure}", "110 bar", "sweep.pressure: no text contains {pressure}"),
        ('["100 bar", "120 bar"]', "[]", "sweep: write lists of values by name"),
        ('after = "change"', 'after = "chance"', "'chance', did you mean 'change'?"),
        ("repeat = 2", "repeat = 2000", "less than or equal to 1000"),
        ("repeat = 2", "repeat = 600", "make more than 1000 runs"),
        ("0x301 01 02", "0x301 1 2 3", "'0x301 1 2 3' is not a frame"),
        ("node5.tpdo1", "node5.pdo1", "'node5.pdo1' is not a message"),
        ("0x1000", "device", "'device' is not an object"),
        ("supply_pressure = ", "position = \"1 mm\", supply_pressure = ", "has no controller"),
        ('from = "10 ms"', 'after_each = "sync"', "after_each needs a frame and its longest delay"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_run_is_named(swept: Path, old: str, new: str, message: str) -> None:
    """Before the first run."""
    swept.write_text(swept.read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=re.escape(message)):
        runs_of(swept)


@pytest.mark.parametrize(
    ("old", "new"),
    [("node5.tpdo1", "node6.tpdo1"), ("node5.tpdo1", "tpdo99"), ("0x1000", "0x9999")],
)
def test_what_the_rig_lacks_cannot_be_expected(swept: Path, old: str, new: str) -> None:
    """A node, a PDO or an object that does not exist is an error, not an expectation that fails."""
    swept.write_text(swept.read_text().replace(old, new))
    with pytest.raises(UserError, match=f"expect: {new}: no node"):
        hil.play(swept)


def test_the_page_shows_the_scenario_of_the_package() -> None:
    """Line by line."""
    assert block("how_to/scenarios.md", "toml", "# Your") == HOLD.read_text()


def test_the_controller_in_python_of_the_page_passes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the folder into which the scenario was copied."""
    from hil_emulator.platform.packaged import copy

    copy("hold_position", tmp_path)
    monkeypatch.chdir(tmp_path)
    exec(block("how_to/scenarios.md", "python", "import struct"), {})
    assert capsys.readouterr().out.startswith("True\n")


def shell(page: str, number: int) -> list[str]:
    """Return the lines of a page's block for the shell."""
    return re.findall(r"^```sh\n(.*?)^```$", PAGES[page], re.M | re.S)[number].splitlines()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_controller_in_c_of_the_page_fails_with_a_low_gain(tmp_path: Path) -> None:
    """Through TCP in real time; `test_printed_commands.py` runs it with the gain that passes."""
    (tmp_path / "controller.c").write_text(block("how_to/scenarios.md", "c", "/* controller.c"))
    (emulate,), (compile_, control) = (shell("how_to/scenarios.md", i) for i in (0, 1))
    subprocess.run(
        [*shlex.split(compile_), "-Wall", "-Wextra", "-Werror"], cwd=tmp_path, check=True
    )
    program = [sys.executable, "-u", "-m", "hil_emulator"]
    emulator = subprocess.Popen(
        [*program, *shlex.split(emulate)[1:], "--port", "0"], cwd=tmp_path,
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert emulator.stdout is not None
    lines = iter(emulator.stdout.readline, "")
    port = next(m[1] for line in lines if (m := re.search(r"127\.0\.0\.1:(\d+)", line)))
    controller = subprocess.Popen([control, "0.01", port], cwd=tmp_path)
    rest, _ = emulator.communicate(timeout=60)
    assert emulator.returncode == 1, rest
    assert controller.wait(timeout=10) == 0
    assert rest.count("  met     ") + rest.count("  MISSED  ") == 4
    assert {"report.html", "report.xml", "run.rec"} <= {f.name for f in tmp_path.iterdir()}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_job_of_the_page_passes(tmp_path: Path) -> None:
    """By a plain shell, on a free port; its exit code is the verdict."""
    (tmp_path / "controller.c").write_text(block("how_to/scenarios.md", "c", "/* controller.c"))
    subprocess.run(shlex.split(shell("how_to/scenarios.md", 1)[0]), cwd=tmp_path, check=True)
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    job = "\n".join(shell("how_to/scenarios.md", 2))
    job = job.replace("hil-emulator", f"{sys.executable} -m hil_emulator")
    job = job.replace(" &", f" --port {port} &").replace("./controller", f"./controller 0.1 {port}")
    done = subprocess.run(
        ["sh", "-c", job], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    verdict = re.search(r"^(pass|FAIL)", done.stdout, re.M)
    assert verdict, done.stdout + done.stderr
    assert done.returncode == {"pass": 0, "FAIL": 1}[verdict[1]]
    assert "<testsuite" in (tmp_path / "job.xml").read_text()


def test_a_missed_band_beyond_the_curve_is_in_the_picture(swept: Path) -> None:
    """The axis grows until an edge of the band is on it."""
    from matplotlib.figure import Figure

    from hil_emulator.scenario.report import _expected

    (*_, outcome) = hil.play(swept)  # 120 bar, where 99 to 101 bar are expected
    axis = Figure().subplots()
    axis.plot(outcome.curves["time"], outcome.curves["supply_pressure"] * 1e-5)
    _expected(axis, outcome.bands, 1e-5)
    low, high = axis.get_ylim()
    assert low < 101.0 < 120.0 < high


def test_the_panel_refuses_a_scenario_for_a_controller_on_the_bus(tmp_path: Path) -> None:
    """Its emulator is on no bus; the message has the command that waits for the controller."""
    with pytest.raises(UserError, match="`hil-emulator run --scenario hold_position --panel`"):
        next(play_on_panel(HOLD))
    mine = tmp_path / "mine.toml"
    mine.write_text(HOLD.read_text())
    with pytest.raises(UserError, match=rf"--scenario \S*{mine.name} --panel"):
        next(play_on_panel(mine))
