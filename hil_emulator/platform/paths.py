"""Paths of the packaged files and the cache."""

import os
from pathlib import Path

import platformdirs

from hil_emulator.errors import UserError

_PACKAGE = Path(__file__).parents[1]


def shipped(name: str) -> Path:
    """Return a file of `configs/` or `eds/`, in a checkout or in the installed package.

    Raises:
        UserError: if the installation lacks it.

    """
    for root in (_PACKAGE, _PACKAGE.parent):
        if (root / name).is_file():
            return root / name
    raise UserError(f"{name} is missing from the installation; install hil-emulator again")


def cache_folder() -> Path:
    """Return the folder of compiled models, below NUMBA_CACHE_DIR if it is set."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else platformdirs.user_cache_path("hil-emulator") / "kernels"


def near(path: Path) -> str:
    """Return a path in its short form, as a user would type it in the working folder."""
    resolved = path.resolve()
    here = Path.cwd()
    return str(resolved.relative_to(here) if resolved.is_relative_to(here) else resolved)
