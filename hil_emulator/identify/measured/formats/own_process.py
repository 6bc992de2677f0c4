"""Reading in a separate process, for libraries that a damaged file can crash."""

import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.formats.table import LogColumn, LogTable

RUNNING = 2 * input_files.GIB
"""Address space of a process that has imported what it reads with [B] (measured: 1.3 GiB)."""

COPIES = 4
"""Simultaneous copies of the content during reading: packed, unpacked, as numbers, written."""

_REFUSED = 2


def read(reader: str, file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read a file by a module of this folder in a separate process.

    asammdf and scipy's reader of MATLAB files read in C and trust lengths that a damaged file
    states: they may write beyond their memory, print, or end the process.

    Args:
        reader: name of the module.
        file: the file.
        headings: names and units of its columns, if it has no header.

    Raises:
        UserError: as the module does, and if the process has ended.

    """
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "table.npz"
        command = [sys.executable, "-m", __name__, reader, str(file), str(table), *headings]
        ended = subprocess.run(command, capture_output=True, env=_few_threads())
        if ended.returncode == 0:
            return _unpacked(table)
        if ended.returncode == _REFUSED:
            raise UserError(table.read_text())
    raise UserError(f"{file}: is not readable: it ends the process that reads it")


def _few_threads() -> dict[str, str]:
    """Return an environment in which no library reserves memory for many threads."""
    return os.environ | dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")


def _limit_memory(file: Path) -> None:
    """Limit the memory of this process to what reading a file may need."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most = RUNNING + COPIES * input_files.largest_unpacked(file)
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _pack(table: LogTable, file: Path) -> None:
    """Write a table as arrays without code; channels of one clock share an array."""
    clocks = {id(column.time): column.time for column in table.columns}
    places = {key: place for place, key in enumerate(clocks)}
    arrays: dict[str, Array] = {f"time_{places[k]}": t for k, t in clocks.items() if t is not None}
    arrays |= {f"values_{i}": column.values for i, column in enumerate(table.columns)}
    columns = [(c.name, c.unit, places[id(c.time)]) for c in table.columns]
    description = json.dumps(
        {"set_point_first": table.set_point_first, "notes": table.notes, "columns": columns}
    )
    with file.open("wb") as stream:
        np.savez(stream, allow_pickle=False, description=np.array(description), **arrays)


def _unpacked(file: Path) -> LogTable:
    with np.load(file) as arrays:
        description = json.loads(str(arrays["description"]))
        clocks = {name: arrays[name] for name in arrays.files if name.startswith("time_")}
        columns = tuple(
            LogColumn(name, unit, arrays[f"values_{index}"], clocks.get(f"time_{clock}"))
            for index, (name, unit, clock) in enumerate(description["columns"])
        )
    return LogTable(columns, description["set_point_first"], tuple(description["notes"]))


def _main(reader: str, file: str, table: str, *headings: str) -> int:
    module = importlib.import_module(f"{__package__}.{reader}")
    try:
        _limit_memory(Path(file))
        _pack(module.read(Path(file), headings), Path(table))
    except UserError as error:
        Path(table).write_text(str(error))
        return _REFUSED
    except MemoryError:
        Path(table).write_text(f"{file}: needs too much memory: it is damaged, or has to be cut")
        return _REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
