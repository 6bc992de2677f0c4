"""The display of the time left while a command works."""

import io
import re
import sys
import time
from pathlib import Path

import numba
import pytest
from numba.core.event import RecordingListener, install_listener

from hil_emulator.commands import waiting as module
from hil_emulator.commands.past_times import NAME, Usual, job, recall, remember
from hil_emulator.commands.waiting import compilation_of, left, waiting


@pytest.fixture(autouse=True)
def _quick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Store past times in a separate folder, and print early."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setattr(module, "SILENT", 0.02)
    monkeypatch.setattr(module, "_EVERY", {True: 0.02, False: 0.02})


def first_line(what: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the first line that is printed during a job."""
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with waiting(what):
        deadline = time.monotonic() + 30.0
        while "\n" not in sys.stderr.getvalue() and time.monotonic() < deadline:
            time.sleep(0.01)
    return sys.stderr.getvalue()


def test_the_second_run_shows_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """At first the time is unknown; then the last time is the usual one."""
    assert "s, time left unknown: first time on this machine\n" in first_line("work", monkeypatch)
    assert 0.0 < recall("work").work < 60.0
    remember("work", 1e6, 0.0)
    assert re.match(
        r"work; \d+ s, some (1000000|9999\d\d) s left\n", first_line("work", monkeypatch)
    )


def test_a_short_job_prints_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its time is not stored either."""
    monkeypatch.setattr(module, "SILENT", 60.0)
    with waiting("work"):
        pass
    assert capsys.readouterr().err == ""
    assert recall("work") == Usual()


def test_a_program_that_reads_is_not_disturbed(capsys: pytest.CaptureFixture[str]) -> None:
    """With --json and no terminal, both streams stay empty."""
    with waiting("work", json=True):
        time.sleep(0.1)
    assert capsys.readouterr() == ("", "")


def test_a_report_meanwhile_has_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    """The line goes to stderr, so that stdout holds the result alone."""
    with waiting("work") as progress:
        progress.report("half of it")
    out, err = capsys.readouterr()
    assert (out, "half of it\n" in err) == ("", True)


def test_compiling_is_separated_from_work() -> None:
    """It is the time in which numba compiles; inner functions are counted once."""
    heard = RecordingListener()
    begin = time.time()
    with install_listener("numba:compile", heard):
        inner = numba.njit(lambda x: x + 1.0)
        numba.njit(lambda x: inner(x) * 2.0)(1.0)
    spent, busy = compilation_of(heard)
    assert (0.0 < spent <= time.time() - begin, busy) == (True, False)
    heard.buffer.pop()
    assert compilation_of(heard)[1]


def test_the_time_of_compilation_is_kept_after_a_start_without_it() -> None:
    """It is due again when a model or this package changes."""
    remember("work", 10.0, 30.0)
    remember("work", 11.0, 0.0)
    assert recall("work") == Usual(11.0, 30.0)
    assert recall("work").whole(compiled=True) == 41.0
    assert recall("work").whole(compiled=False) == 11.0
    assert Usual(11.0).whole(compiled=True) is None


def test_a_longer_log_is_another_job(tmp_path: Path) -> None:
    """A job is known by name and size of its log."""
    log = tmp_path / "log.csv"
    log.write_text("1\n")
    short = job("gap", [log])
    log.write_text("1\n2\n")
    assert short != job("gap", [log])


@pytest.mark.parametrize("text", ["", "[]", '{"work": 3}', '{"work": ["x", "y"]}', "{"])
def test_a_damaged_file_of_past_times_is_ignored(text: str, tmp_path: Path) -> None:
    """Past times are optional: a damaged file is replaced without an error."""
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / NAME).write_text(text)
    assert recall("work") == Usual()
    remember("work", 3.0, 0.0)
    assert recall("work") == Usual(3.0)


def test_more_than_usual_is_reported() -> None:
    """The text names a time that is longer than the last one."""
    assert left(5.0, 3.0) == "5 s, longer than the 3 s of last time"
