"""A forked worker process, and the connection to it."""

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection

from hil_emulator.platform.helper_process import HelperFailedError, ending

_PR_SET_PDEATHSIG = 1  # Linux <linux/prctl.h>


def can_fork() -> bool:
    """Return whether a process with compiled code can be forked safely: on Linux only."""
    return sys.platform == "linux"


def usable_cores() -> int:
    """Return the number of workers that can run at once."""
    return len(os.sched_getaffinity(0)) if can_fork() else 1


class Worker:
    """A forked copy of this process, with the machine code that is compiled here.

    Ctrl-C does not reach the worker: the process that started it ends it. The worker does not
    outlive that process.

    Args:
        work: function to run, called with the worker's end of the connection; its errors are
            printed.

    Attributes:
        line: this end of the connection; raises `EOFError` once the worker has ended.

    """

    def __init__(self, work: Callable[[Connection], None]) -> None:
        context = multiprocessing.get_context("fork")
        self.line, theirs = context.Pipe()
        self._process = context.Process(target=_begin, args=(work, theirs, os.getpid()))
        self._process.start()
        theirs.close()

    def stop(self) -> None:
        """Send SIGTERM to the worker."""
        self._process.terminate()

    def failure(self, name: str) -> HelperFailedError:
        """Return the error for a worker that ended by itself; its message begins with `name`."""
        self._process.join()
        how = ending(self._process.exitcode or 0)
        return HelperFailedError(f"{name} {how}, which ends the run; start it again")

    def join(self) -> None:
        """Wait until the worker has ended."""
        self._process.join()
        self.line.close()


def _begin(work: Callable[[Connection], None], line: Connection, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() == parent:
        work(line)
