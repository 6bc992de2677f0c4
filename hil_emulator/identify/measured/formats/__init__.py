"""Files that hold recorded columns, one module per format; each has one function, `read`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
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
from hil_emulator.identify.measured.formats.table import (
    ASAMMDF,
    H5PY,
    NPTDMS,
    OPENPYXL,
    PYARROW,
    Library,
    LogTable,
)


@dataclass(frozen=True)
class LogFormat:
    """A format of files that hold recorded columns.

    Attributes:
        endings: of its files, in lower case.
        name: of the format.
        labels: where the names and units of the columns stand.
        times: where the times stand.
        read: reads a file; takes the headings of its columns as well, if `takes_headings`.
        takes_headings: whether the user may have to name the columns.
        library: what reading needs besides the required packages.

    """

    endings: tuple[str, ...]
    name: str
    labels: str
    times: str
    read: Callable[..., LogTable]
    takes_headings: bool = False
    library: Library | None = None


_HEADER = "header `name [unit]`, or a row of units; else `--columns`"
_CHANNELS = "those of the channels"
_TIME = "the column `time`"

FORMATS = (
    LogFormat(
        (".csv", ".txt", ".tsv", ".asc", ".dat", ".log", ".prn"), "text in columns",
        _HEADER, _TIME, delimited_text.read, takes_headings=True,
    ),
    LogFormat(
        (".xlsx",), "Excel", _HEADER, _TIME, spreadsheet.read, takes_headings=True,
        library=OPENPYXL,
    ),
    LogFormat(
        (".lvm",), "LabVIEW measurement", _CHANNELS, "X columns or rate", labview_text.read
    ),
    LogFormat(
        (".tdms",), "LabVIEW, DIAdem", _CHANNELS, f"waveform rate, or {_TIME}",
        labview_binary.read, library=NPTDMS,
    ),
    LogFormat(
        (".mat",), "MATLAB; the library only for version 7.3",
        "`name_unit`, or a structure `units`; of a matrix `--columns`", "the vector `time`",
        partial(own_process.read, "matlab"), takes_headings=True, library=H5PY,
    ),
    LogFormat(
        (".npz",), "recording of the emulator", "its table of units", _TIME, numpy_archive.read
    ),
    LogFormat(
        (".parquet",), "Apache Parquet", "`name [unit]`, or metadata `unit` of the field", _TIME,
        parquet.read, library=PYARROW,
    ),
    LogFormat(
        (".mf4", ".mdf"), "ASAM MDF, also in `.dat`; signals or raw frames",
        _CHANNELS, "those of the channel groups",
        partial(own_process.read, "measurement_data"), library=ASAMMDF,
    ),
)  # fmt: skip

BY_ENDING = {ending: form for form in FORMATS for ending in form.endings}
"""The format of each ending."""

ENDINGS = tuple(BY_ENDING)

_BEGINNINGS = {
    b"MDF     ": ".mf4", b"UnFinMF ": ".mf4", b"LabVIEW Measurement": ".lvm", b"TDSm": ".tdms",
    b"PAR1": ".parquet",
}  # fmt: skip
"""How files begin whose ending may be that of another format."""


def read(file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read a file in the format that its beginning shows, or else in that of its ending.

    Args:
        file: the file.
        headings: names and units of its columns, such as "position [mm]", if it has no header.

    Raises:
        UserError: if the ending is unknown, the file is damaged or too large, or its format needs
            a package that is not installed.

    """
    input_files.check(file, input_files.LOG)
    ending = _ending(file)
    if ending not in BY_ENDING:
        raise UserError(f"{file}: unknown ending; a table of columns ends in {', '.join(ENDINGS)}")
    chosen = BY_ENDING[ending]
    return chosen.read(file, headings) if chosen.takes_headings else chosen.read(file)


def _ending(file: Path) -> str:
    """Return the ending that a file's format usually has."""
    with file.open("rb") as stream:
        head = stream.read(max(map(len, _BEGINNINGS)))
    shown = (ending for start, ending in _BEGINNINGS.items() if head.startswith(start))
    return next(shown, file.suffix.lower())
