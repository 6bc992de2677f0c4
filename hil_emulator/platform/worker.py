"""A process that goes on from where this one is, and the line to it."""

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
    """Tell whether a copy of a process that has compiled code is safe: on Linux alone."""
    return sys.platform == "linux"


def usable_cores() -> int:
    """Return how many workers can run at once."""
    return len(os.sched_getaffinity(0)) if can_fork() else 1


class Worker:
    """A copy of this process that does some work; what is compiled here is so there, too.

    Ctrl-C does not reach it: who has started it tells when it shall end. It does not outlive that.

    Args:
        work: what it does, given its end of the line; an error that leaves it is printed.

    Attributes:
        line: this end; it raises `EOFError` once the worker has gone.

    """

    def __init__(self, work: Callable[[Connection], None]) -> None:
        context = multiprocessing.get_context("fork")
        self.line, theirs = context.Pipe()
        self._process = context.Process(target=_begin, args=(work, theirs, os.getpid()))
        self._process.start()
        theirs.close()

    def stop(self) -> None:
        """Ask it to end: SIGTERM."""
        self._process.terminate()

    def failure(self, name: str) -> HelperFailedError:
        """Return the error for a worker that ended by itself, which its name begins."""
        self._process.join()
        how = ending(self._process.exitcode or 0)
        return HelperFailedError(f"{name} {how}, which ends the run; start it again")

    def join(self) -> None:
        """Wait until it has ended."""
        self._process.join()
        self.line.close()


def _begin(work: Callable[[Connection], None], line: Connection, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() == parent:
        work(line)
