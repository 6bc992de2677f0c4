"""What every format is read into: columns with names, units and times."""

import importlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array

_LABEL = re.compile(
    r"^\s*(?P<name>[^\[\]()]+?)\s*(\[\s*(?P<unit>[^\[\]]*)\s*\]|\((?P<other>[^()\[\]]*)\))\s*$"
)


@dataclass(frozen=True)
class LogColumn:
    """One recorded quantity.

    Attributes:
        name: as it stands in the file.
        unit: as it stands in the file: "1" for a plain number, None where none is stated.
        values: in that unit, NaN where a value is missing.
        time: of each value [s]; None where the table's column `time` tells.

    """

    name: str
    unit: str | None
    values: Array
    time: Array | None = None


@dataclass(frozen=True)
class LogTable:
    """The columns of a file.

    Attributes:
        columns: in the order of the file.
        set_point_first: whether a row's set point had acted before its readings were taken, as
            the emulator records it; otherwise it acts from then on.
        notes: what was found while reading.

    """

    columns: tuple[LogColumn, ...]
    set_point_first: bool = False
    notes: tuple[str, ...] = ()


def label(text: str) -> tuple[str, str | None]:
    """Return name and unit of a heading such as `position [mm]` or `position (mm)`."""
    match = _LABEL.match(text)
    if match is None:
        return text.strip(), None
    unit = match["unit"] if match["unit"] is not None else match["other"]
    return match["name"].strip(), unit.strip() or "1"


def module(name: str, file: Path, extra: str = "recording", package: str = "") -> Any:
    """Import what a format needs, or say what to install.

    Args:
        name: of the module.
        file: that needs it.
        extra: of this package that brings it.
        package: what it is called where it is installed from, if not like the module.

    Raises:
        UserError: if the package is not there.

    """
    try:
        return importlib.import_module(name)
    except ImportError:
        package = package or name.partition(".")[0]
        raise UserError(
            f"{file}: reading it needs {package}, which is not installed; "
            f"pip install 'hil-emulator[{extra}]'"
        ) from None
