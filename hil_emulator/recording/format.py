"""Declaration of a format of another tool, each in its file of the folder `formats`."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.errors import UserError

EXTRA = "recording"
"""Extra of this package with the libraries of formats."""


@dataclass(frozen=True)
class Format:
    """A format that a journal can be written in.

    Attributes:
        endings: of its files, such as ".csv".
        write: writes a journal (first argument) into a file.
        needs: the required module, of the extra `recording`.
        companions: further files that `write` makes, in the same folder.
        directed: writes the same with the direction of each frame, if that is not usual.

    """

    endings: tuple[str, ...]
    write: Callable[[Path, Path], None]
    needs: str = ""
    companions: Callable[[Path], tuple[Path, ...]] = lambda _: ()
    directed: Callable[[Path, Path], None] | None = None

    def check(self, file: Path) -> None:
        """Refuse a file if a library of the format is not installed.

        Raises:
            UserError: names what to install.

        """
        try:
            if self.needs:
                importlib.import_module(self.needs)
        except ImportError:
            raise UserError(
                f"{file}: needs {self.needs}, which is not installed; "
                f"pip install 'hil-emulator[{EXTRA}]'"
            ) from None
