"""Files that hold recorded columns, one module per format; each has one function, `read`.

| ending | format | names and units | times |
|---|---|---|---|
| .csv .txt .tsv | text in columns | header `name [unit]`, or a row of units | the column `time` |
| .xlsx | Excel | the same | the same |
| .lvm | LabVIEW measurement | the channels' own | X columns or rate |
| .tdms | LabVIEW, DIAdem | the channels' own | waveform rate, or the column `time` |
| .mat | MATLAB | `name_unit`, or a structure `units` | the vector `time` |
| .npz | recording of the emulator | its table of units | the column `time` |
| .parquet | Apache Parquet | `name [unit]`, or metadata `unit` of the field | the column `time` |
| .mf4 .mdf .dat | ASAM MDF | the channels' own | the channel groups' own |
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import (
    delimited_text,
    labview_binary,
    labview_text,
    numpy_archive,
    own_process,
    parquet,
    spreadsheet,
)
from hil_emulator.identify.measured.formats.table import LogTable

NAMED: dict[str, Callable[[Path, Sequence[str]], LogTable]] = {
    ".csv": delimited_text.read,
    ".txt": delimited_text.read,
    ".tsv": delimited_text.read,
    ".xlsx": spreadsheet.read,
    ".mat": partial(own_process.read, "matlab"),
}
"""What reads each ending, in lower case, whose columns may have to be named."""

OTHERS: dict[str, Callable[[Path], LogTable]] = {
    ".lvm": labview_text.read,
    ".tdms": labview_binary.read,
    ".npz": numpy_archive.read,
    ".parquet": parquet.read,
    ".mf4": partial(own_process.read, "measurement_data"),
    ".mdf": partial(own_process.read, "measurement_data"),
    ".dat": partial(own_process.read, "measurement_data"),
}
"""What reads each other ending."""

ENDINGS = (*NAMED, *OTHERS)


def read(file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read a file in the format of its ending.

    Args:
        file: the file.
        headings: names and units of its columns, such as "position [mm]", if it does not tell.

    Raises:
        UserError: if the ending is unknown, the file is damaged or too large, or its format needs
            a package that is not installed.

    """
    input_files.check(file, input_files.LOG)
    ending = file.suffix.lower()
    if ending in NAMED:
        return NAMED[ending](file, headings)
    if ending in OTHERS:
        return OTHERS[ending](file)
    raise UserError(f"{file}: unknown ending; a table of columns ends in {', '.join(ENDINGS)}")
