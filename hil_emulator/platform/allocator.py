"""Memory of large arrays goes back to the system, some of the small ones stays in reserve."""

import ctypes
import sys

_M_TOP_PAD = -2
_M_MMAP_THRESHOLD = -3
"""Parameters of glibc's `mallopt` (malloc.h)."""

_LARGE = 2 << 20
"""Size from which an array gets pages of its own [B] (assumed): those of a few seconds of a
recording, of which a search makes most, would wait for fresh pages each time."""

_IN_RESERVE = 32 << 20
"""Memory behind all smaller arrays that stays when they are gone [B] (assumed): without it, pages
that go back and come again take 6 % of the time of a search."""


def tune_allocator() -> None:
    """Let every large array of this process have pages of its own, and smaller ones a reserve.

    glibc raises the size from which it does so up to 32 MB as such arrays are freed; arrays of
    two megabytes or more, of which a search makes thousands, then leave holes that nothing else
    fills. Does nothing where there is no glibc.
    """
    if sys.platform.startswith("linux"):
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(_M_MMAP_THRESHOLD, _LARGE)
            mallopt(_M_TOP_PAD, _IN_RESERVE)
