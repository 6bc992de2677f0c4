"""Replay: the same frames in, the same frames out."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import pytest
from recorded import script
from rigs import START, bench, reference, set_point

from hil_emulator.commands.replay import compare, replay
from hil_emulator.config.load import load
from hil_emulator.demo.script import perform
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.recording import journal as journals
from hil_emulator.recording.exports import export
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.journal import Recording
from hil_emulator.simulation.clock import FollowSync

REFERENCE = shipped("configs/hyq_knee.toml")


def hil_emulator(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own."""
    command = [sys.executable, "-m", "hil_emulator", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_the_demo_is_reproduced_bit_for_bit() -> None:
    """2.8 s of position and force control: every frame, every signal of every tick."""
    recording = perform(cache_folder(), lambda text: None).recording
    files = [shipped("configs/hyq_knee.toml"), shipped("configs/spring_load.toml")]
    result = compare(recording, load(files))
    assert len(result.recorded) > 8000
    assert result.same


def test_faults_and_settings_are_repeated_with_the_frames(recording: Recording) -> None:
    """A recording in which a sensor was stuck is reproduced, fault and all."""
    assert recording.events
    assert compare(recording, load([REFERENCE])).same
    without = dataclasses.replace(recording, events=[])
    assert not compare(without, load([REFERENCE])).same


@pytest.mark.slow
def test_the_command_says_where_another_machine_differs(journal: Path, tmp_path: Path) -> None:
    """The same files give exit code 0; a lower supply gives 1, the frame and the signals."""
    assert hil_emulator("replay", journal).returncode == 0
    layer = tmp_path / "low.toml"
    layer.write_text('[supply]\npressure = "150 bar"\n')
    result = hil_emulator("replay", journal, REFERENCE, layer)
    assert result.returncode == 1
    assert "differs" in result.stdout
    assert "node5_TPDO1" in result.stdout
    assert "supply_pressure" in result.stdout


@pytest.mark.parametrize(
    "ending",
    [*(pytest.param(e, marks=pytest.mark.slow) for e in (".blf", ".asc")), ".log"],
)
def test_a_log_of_frames_can_be_replayed_too(tmp_path: Path, ending: str) -> None:
    """With the configuration named, the controller's frames of any log are enough."""
    config = reference()
    with bench(config) as b:
        for k in range(200):
            b.tick(*script(k))
        made = remembered(b.recorder, header(config, b.rig.nodes))
    journals.write(made, tmp_path / "run.rec")
    export(tmp_path / "run.rec", tmp_path / f"run{ending}", directions=True)
    result = hil_emulator("replay", tmp_path / f"run{ending}", REFERENCE)
    assert f"bit for bit: {sum(sent for _, sent, _ in made.frames)} frames" in result.stdout


def test_a_log_without_directions_is_not_replayed(tmp_path: Path) -> None:
    """The emulator's own frames would be taken for the controller's."""
    config = reference()
    with bench(config) as b:
        b.ticks(200)
        journals.write(remembered(b.recorder, header(config, b.rig.nodes)), tmp_path / "run.rec")
    export(tmp_path / "run.rec", tmp_path / "run.log")
    with pytest.raises(UserError, match="--record-direction"):
        replay(tmp_path / "run.log", [REFERENCE])


def test_a_recording_under_the_clients_sync_is_reproduced() -> None:
    """What a master asks while time stands still is answered then, in the repetition too."""
    config = reference()
    with bench(config) as b:
        follow = FollowSync(b.rig.bus, config.sync_period_ns)  # type: ignore[arg-type]
        follow.serve = b.rig.serve
        b.rig.bus, b.clock = follow, follow
        b.rig.serve(())
        request = Frame(0x605, bytes.fromhex("4000100000000000"))
        b.tick(request, Frame(0x080))
        b.tick(START, set_point(1.0), Frame(0x080))
        for _ in range(50):
            b.tick(set_point(1.0), Frame(0x080), request)
        made = remembered(b.recorder, header(config, b.rig.nodes))
    assert sum("serve" in what for _, what in made.events) > 50
    result = compare(made, config)
    assert len(result.recorded) > 150
    assert result.same


def test_time_that_slipped_is_recorded_and_does_not_harm_the_repetition() -> None:
    """The wall was missed, the emulator's own time was not."""
    config = reference()
    with bench(config) as b:
        b.ticks(5, START)
        b.rig.slip(3_000_000)
        b.rig.slip(3_000_000)
        b.ticks(5)
        made = remembered(b.recorder, header(config, b.rig.nodes))
    assert made.events == [(5_000_000, {"slipped": 3_000_000})]
    assert compare(made, config).same


def test_a_capture_is_not_replayed(recording: Recording, tmp_path: Path) -> None:
    """A capture does not begin at the start and cannot be reproduced; a message explains it."""
    head = {**recording.header, "capture": "position > 60 mm"}
    file = tmp_path / "part.rec"
    journals.write(dataclasses.replace(recording, header=head), file)
    result = hil_emulator("replay", file)
    assert result.returncode == 2
    assert "only a recording from the start can be replayed" in result.stderr


@pytest.mark.slow
def test_a_picture_shows_the_chosen_signals(journal: Path, tmp_path: Path) -> None:
    """The picture is written; an unknown signal is answered with the known ones."""
    picture = tmp_path / "run.png"
    assert not hil_emulator("plot", journal, "--picture", picture).returncode
    assert picture.read_bytes()[:4] == b"\x89PNG"
    result = hil_emulator("plot", journal, "speed")
    assert result.returncode == 2
    assert "no signal 'speed'; there are time, valve_current" in result.stderr
