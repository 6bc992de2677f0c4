"""The versions of numba that this program runs with."""

from importlib.metadata import version

from hil_emulator.errors import UserError

OLDEST, NEWEST = (0, 62), (0, 68)
"""Minor versions of numba, from the first to the last that the tests were run with. Compiling uses
parts of numba that may change with each minor version; `pyproject.toml` has the same bounds."""


def require_supported_numba() -> None:
    """Check the version of numba, before anything that may differ in another one is imported.

    Raises:
        UserError: if it lies outside the bounds.

    """
    installed = version("numba")
    minor = tuple(int(part) for part in installed.split(".")[:2])
    if not OLDEST <= minor <= NEWEST:
        oldest, newest = (f"{major}.{minor}" for major, minor in (OLDEST, NEWEST))
        after = f"{NEWEST[0]}.{NEWEST[1] + 1}"
        raise UserError(
            f"numba {installed} is installed, but hil-emulator runs with numba {oldest} to "
            f"{newest}; install one of these: pip install 'numba>={oldest},<{after}'"
        )
