"""Failures of helper processes on the panel's page."""

import os
import resource
import signal
from pathlib import Path

import pytest

from tests.panel.bench import Page, running, visit
from tests.processes import child

MEMORY = resource.RLIM_INFINITY
FULL = (100, MEMORY)
"""Bytes that a file can have: as on a disk without room."""
ROOM = (1 << 16, MEMORY)
"""Room for the header of a recording, and some ticks."""


@pytest.mark.slow
def test_a_page_shows_what_has_failed(tmp_path: Path) -> None:
    """A killed remote control, a recording that the disk has no room for, a killed scenario.

    *Record* answers with the reason if the first block cannot be written. If the disk is full
    later, the page shows it and the next recording can begin. The run ends with exit code 3.
    """
    with running("--panel", "--control", "0", folder=tmp_path, code=3) as bench:
        emulator = bench.process.pid
        panel = child(emulator, "panel.serve")
        os.kill(child(emulator, "http_server"), signal.SIGKILL)

        async def act(page: Page) -> None:
            message = await page.word(lambda m: m.get("status", {}).get("failures"))
            assert "remote control: its process was ended by signal 9" in str(message)
            resource.prlimit(panel, resource.RLIMIT_FSIZE, FULL)
            refused = await page.ask(do="record", file="full.rec")
            assert refused["error"] == (
                "recording: full.rec: cannot be written: File too large; make room"
            )
            resource.prlimit(panel, resource.RLIMIT_FSIZE, ROOM)
            assert "error" not in await page.ask(do="record", file="cut.rec")
            message = await page.word(lambda m: len(m.get("status", {}).get("failures", ())) == 2)
            assert "cut.rec ends early: File too large" in message["status"]["failures"][1]
            assert message["status"]["recording"] is None
            resource.prlimit(panel, resource.RLIMIT_FSIZE, (MEMORY, MEMORY))
            assert "error" not in await page.ask(do="record", file="next.rec")
            await page.word(lambda m: m.get("status", {}).get("recording") == "next.rec")
            await page.ask(do="play", name="stuck_spool_at_speed")
            os.kill(child(panel, "panel.play"), signal.SIGKILL)
            await page.word(lambda m: "trouble" in (m.get("status", {}).get("scenario") or {}))
            await page.word(lambda m: len(m.get("status", {}).get("failures", ())) == 3)

        visit(bench, act)
    assert not (tmp_path / "full.rec").exists()
    assert (tmp_path / "cut.rec").stat().st_size == ROOM[0]
