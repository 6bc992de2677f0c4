"""Recordings of the emulator in numpy's format."""

from pathlib import Path

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats import npz
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable
from hil_emulator.input_files import LOG


def read(file: Path) -> LogTable:
    """Read a recording that `run --record` or `convert` has written.

    Raises:
        UserError: if it is something else.

    """
    try:
        arrays = npz.read(file, LOG)
        units = dict(arrays["units"].tolist())
        columns = tuple(
            LogColumn(name, unit or "1", arrays[name].astype(np.float64))
            for name, unit in units.items()
            if name in arrays
        )
    except UserError:
        raise
    except Exception as error:  # numpy and zip answer damage with many kinds of exception
        raise UserError(f"{file}: is not a recording of the emulator: {error}") from None
    return LogTable(columns, set_point_first=True)
