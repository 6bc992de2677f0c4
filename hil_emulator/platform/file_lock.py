"""What one process does at a time: a lock on a file, which ends with the process that holds it."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # pragma: no cover - on Windows, where nobody waits
    fcntl = None  # type: ignore[assignment]

PATIENCE = 120.0
"""Longest wait for another process [s] (assumed): one that was stopped holds nobody up for ever."""

_ASKED_AGAIN = 0.05
"""Period at which a lock is asked for [s]."""


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Do something while no other process does, unless that one takes all too long.

    The lock ends with the process that holds it. Where a file cannot be locked, nobody waits.
    """
    if fcntl is None:
        yield
        return
    try:
        handle = file.open("a")
    except OSError:
        yield
        return
    with handle:
        _wait(handle.fileno())
        yield


def _wait(handle: int) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_ASKED_AGAIN)
        except OSError:
            return
        else:
            return
