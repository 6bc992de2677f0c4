"""A start without optional libraries that python-can and numba load if they are installed."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


def lean_start() -> None:
    """Load the parts of python-can and numba that a run needs, without their optional libraries.

    These libraries can still be imported afterwards. Use it only in a process of this program: in
    it python-can cannot read MDF, and compiled code cannot use `numpy.dot` since numba does not
    load BLAS.
    """
    lean_bus()
    _without("numba.np.arraymath", "scipy")


def lean_bus() -> None:
    """Load python-can without its reader of MDF logs, which loads pandas: 90 MB and a second."""
    _without("can.io", "asammdf")


def _without(seeker: str, package: str) -> None:
    """Load a module as if an optional package were not installed."""
    with _hidden(package):
        import_module(seeker)


@contextmanager
def _hidden(package: str) -> Iterator[None]:
    """Make imports of a package fail within the context, by None in `sys.modules`.

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
