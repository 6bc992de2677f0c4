"""A start without libraries that others load only because they are installed."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


def lean_start() -> None:
    """Load what a run needs of python-can and numba, as if what they look for were not installed.

    It can still be imported afterwards. For a process of this program's own only: in it python-can
    reads no MDF, and compiled code knows no `numpy.dot`, as numba finds no BLAS, which no model
    needs.
    """
    lean_bus()
    _without("numba.np.arraymath", "scipy")


def lean_bus() -> None:
    """Load python-can without its reader of MDF logs: that brings pandas, 90 MB and a second."""
    _without("can.io", "asammdf")


def _without(seeker: str, package: str) -> None:
    """Load a module as if a package that it looks for were not installed."""
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
