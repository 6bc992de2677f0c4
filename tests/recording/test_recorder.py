"""Recording during a run: what survives failures, and its load on the loop."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from recorded import TICKS
from rigs import START, bench, reference, set_point

from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal_of
from hil_emulator.recording.header import header
from hil_emulator.recording.journal import Recording, read
from hil_emulator.recording.pre_trigger import Capture
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.signals import condition


def test_every_tick_is_in_the_recording(recording: Recording) -> None:
    """Time, readings and frames of each tick; the fault that was injected; the seed."""
    assert recording.table()["time"] == pytest.approx(np.arange(TICKS) * 1e-3)
    sent = [f for _, is_sent, f in recording.frames if is_sent and f.can_id == 0x285]
    assert len(sent) == TICKS - 6  # the node starts in tick 5, its timer then
    assert recording.events[0][1]["fault"]["kind"] == "stuck"
    assert recording.events[1] == (150_000_000, {"end": 0})
    assert recording.provenance["seed"] == "1"


def test_a_cut_journal_is_readable_up_to_the_cut(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """Wherever the file ends, all entries before that are there."""
    data = journal.read_bytes()
    for share in (0.3, 0.6, 0.9):
        file = tmp_path / "cut.rec"
        file.write_bytes(data[: int(len(data) * share)])
        rows = read(file).rows
        assert len(rows) == pytest.approx(share * TICKS, abs=20)
        assert rows.tobytes() == recording.rows[: len(rows)].tobytes()


def running(*options: str) -> subprocess.Popen[str]:
    """Return an emulator under the wall clock that has begun to tick."""
    command = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]
    process = subprocess.Popen(
        [*command, "--bus", "virtual:recording", *options], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    next(line for line in process.stdout if "Ctrl-C ends." in line)
    return process


def test_killing_the_emulator_loses_at_most_the_last_second(tmp_path: Path) -> None:
    """After SIGKILL in the middle, the writer process still completes all formats."""
    import asammdf
    import pandas as pd

    names = ["run.csv", "run.parquet", "run.mf4", "run.rec"]
    options = [text for name in names for text in ("--record", str(tmp_path / name))]
    process = running(*options)
    begin = time.monotonic()
    time.sleep(2.0)
    process.send_signal(signal.SIGKILL)
    lasted = time.monotonic() - begin
    process.wait()
    until(lambda: (tmp_path / "run.mf4").exists() and not (tmp_path / "run.csv.rec").exists())
    time.sleep(1.0)  # the last file is being closed
    last = [
        float((tmp_path / "run.csv").read_text().splitlines()[-1].split(",")[0]),
        pd.read_parquet(tmp_path / "run.parquet")["time"].iloc[-1],
        asammdf.MDF(tmp_path / "run.mf4").get("position").timestamps[-1],
        read(tmp_path / "run.rec").rows[-1, 0],
    ]
    assert min(last) > lasted - 1.0
    assert max(last) - min(last) < 1e-6


def test_killing_the_writer_too_leaves_the_journal(tmp_path: Path) -> None:
    """With both processes gone at once, what was written so far is read and exported."""
    process = running("--record", str(tmp_path / "run.csv"))
    file = tmp_path / "run.csv.rec"
    until(lambda: file.stat().st_size > 500_000)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    if not children.exists():
        pytest.skip("this system does not list the children of a process")
    for child in children.read_text().split():
        os.kill(int(child), signal.SIGKILL)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "run.csv").exists()
    assert read(file).rows[-1, 0] > 0.5


def until(done: object, seconds: float = 20.0) -> None:
    """Wait for something in the outer world."""
    deadline = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.05)


def on_a_small_disk(
    journal: Path, limit: int, *files: Path
) -> "subprocess.CompletedProcess[bytes]":
    """Return the writer of some files that can have so many bytes."""

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return subprocess.run(
        [sys.executable, "-m", "hil_emulator.recording.writer_process", *map(str, files)],
        input=journal.read_bytes(),
        capture_output=True,
        preexec_fn=small,
        check=False,
    )


def test_a_full_disk_ends_the_recording_and_not_the_run(
    journal: Path, recording: Recording, tmp_path: Path
) -> None:
    """The written part is readable, and the message names the reason of the end."""
    file = tmp_path / "full.rec"
    result = on_a_small_disk(journal, journal.stat().st_size // 2, file)
    assert result.returncode == 1
    assert b"ends early: File too large" in result.stdout
    rows = read(file).rows
    assert 0.4 * TICKS < len(rows) < 0.6 * TICKS
    assert rows.tobytes() == recording.rows[: len(rows)].tobytes()


def test_a_recording_has_not_begun_where_its_first_block_finds_no_room(
    journal: Path, tmp_path: Path
) -> None:
    """The writer is not ready: its first line is the reason, and no file stays behind."""
    result = on_a_small_disk(journal, 100, tmp_path / "full.csv")
    assert result.returncode == 1
    (line,) = result.stdout.splitlines()
    assert line.endswith(b"full.csv.rec: cannot be written: File too large; make room")
    assert list(tmp_path.iterdir()) == []


def test_a_format_that_cannot_be_written_leaves_the_journal(journal: Path, tmp_path: Path) -> None:
    """No other format is written then; the message explains how to write them later."""
    folder, other = tmp_path / "run.csv", tmp_path / "run.npz"
    folder.mkdir()
    result = on_a_small_disk(journal, resource.RLIM_INFINITY, folder, other)
    assert result.returncode == 1
    ready, line = result.stdout.decode().splitlines()
    assert ready == ""
    assert "run.csv: exists and is not a regular file" in line
    assert line.endswith(f"hil-emulator convert {folder}.rec {folder} {other}")
    assert (tmp_path / "run.csv.rec").read_bytes() == journal.read_bytes()
    assert not other.exists()


def test_a_file_that_cannot_be_opened_stops_the_run_before_it_begins(tmp_path: Path) -> None:
    """Where a folder stands in the place of the file, the message comes at once."""
    (tmp_path / "run.rec").mkdir()
    config = reference()
    with (
        bench(config) as b,
        pytest.raises(UserError, match=r"run\.rec: exists and is not a regular file"),
    ):
        FileRecorder([tmp_path / "run.rec"], header(config, b.rig.nodes))


def test_a_writer_that_dies_is_reported_at_the_end(tmp_path: Path) -> None:
    """The ticks go on; closing the recorder reports an incomplete recording."""
    config = reference()
    with bench(config) as b:
        recorder = FileRecorder([tmp_path / "run.rec"], header(config, b.rig.nodes))
        b.rig.recorder = recorder
        b.ticks(50)
        os.kill(recorder.writer.pid, signal.SIGKILL)
        b.ticks(100)
        with pytest.raises(UserError, match=r"ended by signal 9 \(SIGKILL\)"):
            recorder.close()
        assert b.rig.now_ns == 150_000_000


def test_a_capture_keeps_what_was_before_the_trigger(tmp_path: Path) -> None:
    """50 ms before the rod passes 45 mm, 20 ms after it, and nothing else."""
    config, file = reference(), tmp_path / "capture.rec"
    capture = Capture(condition.parse("model.position > 45 mm"), 50_000_000, 20_000_000)
    with bench(config) as b:
        b.rig.recorder = FileRecorder([file], header(config, b.rig.nodes, capture.text), capture)
        b.ticks(5)
        b.tick(START)
        b.ticks(400, set_point(1.0))
        b.rig.recorder.close()
    table = read(file).table()
    assert len(table["time"]) == 71
    at = np.flatnonzero(table["model.position"] > 45e-3)[0]
    assert at == 50
    assert capture.triggered_ns == round(table["time"][at] * 1e9)


def test_the_loop_makes_one_system_call_in_twenty_five_ticks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames and rows in between stay in memory; closing hands over the rest without loss."""
    config, calls, ticks = reference(), [], 110
    write = os.write

    def counted(pipe: int, data: bytes) -> int:
        calls.append(len(data))
        return write(pipe, data)

    with bench(config) as b:
        recorder = FileRecorder([tmp_path / "run.rec"], header(config, b.rig.nodes))
        monkeypatch.setattr(os, "write", counted)
        for k in range(ticks):
            recorder.bus(k, [set_point(0.1), START], sent=False)
            recorder.row(k * 1_000_000, b.rig.plant, list(b.rig.sensors.reading))
        assert len(calls) == ticks // 25
        recorder.close()
    assert len(calls) == ticks // 25 + 1
    kept = read(tmp_path / "run.rec")
    assert len(kept.rows) == ticks
    assert len(kept.frames) == 2 * ticks


def test_a_recording_without_a_tick_leaves_no_file(tmp_path: Path) -> None:
    """A run that fails before its first tick can be tried again under the same name."""
    config = reference()
    with bench(config) as b:
        FileRecorder([tmp_path / "run.csv"], header(config, b.rig.nodes)).close()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("names", [["run.csv"], ["run.rec"], ["run.csv", "run.rec"]])
def test_an_old_recording_is_replaced_at_the_end(tmp_path: Path, names: list[str]) -> None:
    """Until the new one is complete the old one is there, and the new one as a journal."""
    config, files = reference(), [tmp_path / name for name in names]
    for file in files:
        file.write_text("old")
    with bench(config) as b:
        b.rig.recorder = FileRecorder(files, header(config, b.rig.nodes), overwrite=True)
        b.ticks(40)
        assert [file.read_text() for file in files] == ["old"] * len(files)
        assert journal_of(files).exists()
        b.rig.recorder.close()
    assert {*tmp_path.iterdir()} == {*files}
    assert all(file.stat().st_size > 1000 for file in files)


def test_an_old_recording_survives_a_writer_that_dies(tmp_path: Path) -> None:
    """What the new one had so far is in its journal."""
    config, file = reference(), tmp_path / "run.rec"
    file.write_text("old")
    with bench(config) as b:
        recorder = FileRecorder([file], header(config, b.rig.nodes), overwrite=True)
        b.rig.recorder = recorder
        b.ticks(64)
        until(lambda: journal_of([file]).stat().st_size > 0)
        until(lambda: len(read(journal_of([file])).rows) > 0)
        os.kill(recorder.writer.pid, signal.SIGKILL)
        with pytest.raises(UserError):
            recorder.close()
    assert file.read_text() == "old"
    assert len(read(journal_of([file])).rows) > 0


def test_a_journal_that_exists_is_never_replaced(tmp_path: Path) -> None:
    """It may be all that is left of a run that was cut short: not even on request."""
    config, journal = reference(), tmp_path / "run.csv.rec"
    journal.write_text("left")
    with bench(config) as b, pytest.raises(UserError, match=r"run\.csv\.rec: .*move it away"):
        FileRecorder([tmp_path / "run.csv"], header(config, b.rig.nodes), overwrite=True)
    assert journal.read_text() == "left"
