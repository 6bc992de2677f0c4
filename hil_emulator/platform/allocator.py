"""Settings of glibc's allocator for the arrays of a search."""

import ctypes
import sys

_M_TOP_PAD = -2
_M_MMAP_THRESHOLD = -3
"""Parameters of glibc's `mallopt` (malloc.h)."""

_LARGE = 2 << 20
"""Size from which an array gets separate pages [B] (assumed): smaller arrays, as of a few seconds
of a recording, are frequent in a search and would need new pages each time."""

_IN_RESERVE = 32 << 20
"""Memory of smaller arrays that is kept after they are freed [B] (assumed): returning and
requesting pages otherwise takes 6 % of the time of a search."""


def tune_allocator() -> None:
    """Give every large array of this process separate pages, and keep a reserve for smaller ones.

    By default glibc raises the size for separate pages up to 32 MB as such arrays are freed. The
    thousands of arrays of 2 MB and more of a search then leave unused holes. Without glibc the
    function does nothing.
    """
    if sys.platform.startswith("linux"):
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(_M_MMAP_THRESHOLD, _LARGE)
            mallopt(_M_TOP_PAD, _IN_RESERVE)
