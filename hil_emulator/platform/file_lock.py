"""A lock on a file for work that one process does at a time."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # pragma: no cover - on Windows, without locks
    fcntl = None  # type: ignore[assignment]

PATIENCE = 120.0
"""Longest wait for another process, which may be stopped [s] (assumed)."""

_ASKED_AGAIN = 0.05
"""Period of the attempts to lock [s]."""


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Hold the lock of a file; continue without it if another process holds it too long.

    The lock ends with the process that holds it. If a file cannot be locked, there is no wait.
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
