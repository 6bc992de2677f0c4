"""Measures of the operating system against late ticks, each tried and reported."""

import ctypes
import gc
import os
import sys
from dataclasses import dataclass

_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4  # Linux <sys/mman.h>
_PRIORITY = 50  # above ordinary work, below the kernel's interrupt threads (assumed)


@dataclass(frozen=True)
class Measure:
    """A measure: its name, whether it works, and the reason if it does not."""

    name: str
    works: bool
    reason: str = ""

    def __str__(self) -> str:
        return f"{self.name}: yes" if self.works else f"{self.name}: no ({self.reason})"


def apply() -> list[Measure]:
    """Request a real-time schedule and locked memory, and freeze the garbage collector."""
    return [_schedule(), _lock_memory(), _freeze()]


def _schedule() -> Measure:
    name = f"SCHED_FIFO {_PRIORITY}"
    if not hasattr(os, "sched_setscheduler"):
        return Measure(name, False, f"not on {sys.platform}")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        return Measure(name, False, f"{error.strerror}; needs CAP_SYS_NICE or an rtprio limit")
    return Measure(name, True)


def _lock_memory() -> Measure:
    name = "locked memory"
    if not sys.platform.startswith("linux"):
        return Measure(name, False, f"not on {sys.platform}")
    libc = ctypes.CDLL(None, use_errno=True)
    # only used pages stay in memory; half of the libraries is never used
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT):
        reason = os.strerror(ctypes.get_errno())
        return Measure(name, False, f"{reason}; needs CAP_IPC_LOCK or a memlock limit")
    return Measure(name, True)


def _freeze() -> Measure:
    gc.collect()
    gc.freeze()
    return Measure("frozen garbage collector", True)
