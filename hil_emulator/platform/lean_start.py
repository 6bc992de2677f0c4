"""A start without libraries that others load only because they are installed."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

_SEEKERS = {"can.io": "asammdf", "numba.np.arraymath": "scipy"}
"""Modules on the way to the bus that look for a package, and the package: python-can's reader of
MDF logs, which brings pandas, and numba's search for BLAS, which no model needs."""


def lean_start() -> None:
    """Load what a run needs of python-can and numba, as if those packages were not installed.

    They can still be imported afterwards. For a process of this program's own only: in it
    python-can reads no MDF, and compiled code knows no `numpy.dot`.
    """
    for seeker, package in _SEEKERS.items():
        with _hidden(package):
            import_module(seeker)


@contextmanager
def _hidden(package: str) -> Iterator[None]:
    """Let imports of a package fail meanwhile, as None among the modules does.

    Source: The Python Language Reference, 5.3.1.
    """
    if package in sys.modules:
        yield
        return
    sys.modules[package] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules[package]
