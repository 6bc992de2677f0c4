"""Files that hold recorded columns, one module per format; each has one function, `read`.

| ending | format | names and units | times |
|---|---|---|---|
| .csv .txt | comma-separated | header `name [unit]` | the column `time` |
| .npz | recording of the emulator | its table of units | the column `time` |
| .parquet | Apache Parquet | `name [unit]`, or metadata `unit` of the field | the column `time` |
| .mf4 .mdf .dat | ASAM MDF | the channels' own | the channel groups' own |
"""

from collections.abc import Callable
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import (
    comma_separated,
    measurement_data,
    numpy_archive,
    parquet,
)
from hil_emulator.identify.measured.formats.table import LogTable

READERS: dict[str, Callable[[Path], LogTable]] = {
    ".csv": comma_separated.read,
    ".txt": comma_separated.read,
    ".npz": numpy_archive.read,
    ".parquet": parquet.read,
    ".mf4": measurement_data.read,
    ".mdf": measurement_data.read,
    ".dat": measurement_data.read,
}
"""What reads each ending, in lower case."""


def read(file: Path) -> LogTable:
    """Read a file in the format of its ending.

    Raises:
        UserError: if the ending is unknown, the file is damaged, or its format needs a package
            that is not installed.

    """
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise UserError(f"{file}: unknown ending; a table of columns ends in {', '.join(READERS)}")
    return reader(file)
