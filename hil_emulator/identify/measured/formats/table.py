"""Result of reading any format: columns with names, units and times."""

import importlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array

_LABEL = re.compile(
    r"^\s*(?P<name>[^\[\]()]+?)\s*(\[\s*(?P<unit>[^\[\]]*)\s*\]|\((?P<other>[^()\[\]]*(?:\([^()]*\))?)\))\s*$"
)


@dataclass(frozen=True)
class LogColumn:
    """One recorded quantity.

    Attributes:
        name: as it stands in the file.
        unit: as it stands in the file: "1" for a plain number, None without a unit.
        values: in that unit, NaN where a value is missing.
        time: of each value [s]; None if the table's column `time` holds it.
        text: a cell of a column that holds texts in most of its rows; "" for numbers.

    """

    name: str
    unit: str | None
    values: Array
    time: Array | None = None
    text: str = ""


@dataclass(frozen=True)
class LogTable:
    """The columns of a file.

    Attributes:
        columns: in the order of the file.
        set_point_first: whether a row's set point had acted before its readings were taken, as
            the emulator records it; False: it acts from then on; None: not stated, so that is
            assumed.
        notes: remarks on the data.

    """

    columns: tuple[LogColumn, ...]
    set_point_first: bool | None = None
    notes: tuple[str, ...] = ()


def label(text: str) -> tuple[str, str | None]:
    """Return name and unit of a heading such as `position [mm]` or `position (mm)`."""
    match = _LABEL.match(text)
    if match is None:
        return text.strip(), None
    unit = match["unit"] if match["unit"] is not None else match["other"]
    return match["name"].strip(), unit.strip() or "1"


@dataclass(frozen=True)
class Library:
    """A package that a format needs and that is installed with an extra of this one.

    Attributes:
        name: of its module.
        extra: the extra that brings it.
        package: its name in the package index.

    """

    name: str
    extra: str
    package: str


ASAMMDF = Library("asammdf", "recording", "asammdf")
H5PY = Library("h5py", "logs", "h5py")
NPTDMS = Library("nptdms", "logs", "npTDMS")
OPENPYXL = Library("openpyxl", "logs", "openpyxl")
PYARROW = Library("pyarrow", "recording", "pyarrow")


def module(library: Library, file: Path) -> Any:
    """Import the library that a file needs.

    Raises:
        UserError: if it is not installed; names the extra that brings it.

    """
    try:
        return importlib.import_module(library.name)
    except ImportError:
        raise UserError(
            f"{file}: reading it needs {library.package}, which is not installed; "
            f"pip install 'hil-emulator[{library.extra}]'"
        ) from None
