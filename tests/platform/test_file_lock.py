"""A lock on a file: who waits, and how long."""

from pathlib import Path

import pytest

from hil_emulator.platform import file_lock
from hil_emulator.platform.file_lock import locked


def test_a_lock_is_had_by_one_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second goes on when its patience ends, or at once where the first has let go."""
    monkeypatch.setattr(file_lock, "PATIENCE", 0.2)
    waited = []
    monkeypatch.setattr(file_lock.time, "sleep", waited.append)
    file = tmp_path / "a.lock"
    with locked(file), locked(file):
        assert waited
    waited.clear()
    with locked(file):
        assert not waited


def test_a_folder_that_cannot_be_written_holds_nobody_up(tmp_path: Path) -> None:
    """If no lock can be created, the block runs without waiting."""
    with locked(tmp_path / "missing" / "a.lock"):
        pass
