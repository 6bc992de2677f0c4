"""Apache Parquet: columns named `name [unit]`, or with their unit as metadata of the field."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats.table import PYARROW, LogColumn, LogTable, label, module

OWN_MARK = b"hil-emulator"
"""Metadata of a table that the emulator has written."""


def read(file: Path) -> LogTable:
    """Read all columns that hold numbers or times.

    Raises:
        UserError: if it is no such file, or pyarrow is not installed.

    """
    arrow = module(PYARROW, file)
    storage = importlib.import_module("pyarrow.parquet")
    try:
        with storage.ParquetFile(file) as source:  # a single file, however folders are named
            stated = source.metadata
            input_files.check_unpacked(file, 8 * stated.num_rows * stated.num_columns)
            # texts may unpack to any size
            wanted = [f.name for f in source.schema_arrow if _is_wanted(arrow, f.type)]
            table = source.read(columns=wanted)
        columns = [_column(arrow, field, table.column(i)) for i, field in enumerate(table.schema)]
    except UserError:
        raise
    except Exception as error:  # pyarrow answers damage with many kinds of exception
        raise UserError(f"{file}: is not a readable Parquet file: {error}") from None
    of_emulator = OWN_MARK in (table.schema.metadata or {})
    return LogTable(tuple(columns), set_point_first=of_emulator or None)


def _is_wanted(arrow: Any, kind: Any) -> bool:
    """Return whether a column holds numbers or times."""
    types = arrow.types
    return any(
        is_kind(kind)
        for is_kind in (types.is_integer, types.is_floating, types.is_timestamp, types.is_duration)
    )


def _column(arrow: Any, field: Any, data: Any) -> LogColumn:
    name, unit = label(field.name)
    stated = (field.metadata or {}).get(b"unit")
    if stated is not None:
        unit = stated.decode() or "1"
    if arrow.types.is_timestamp(field.type) or arrow.types.is_duration(field.type):
        clock = data.cast(arrow.timestamp("ns") if arrow.types.is_timestamp(field.type)
                          else arrow.duration("ns")).cast(arrow.int64())  # fmt: skip
        whole = clock.to_numpy()
        first = float(np.nanmin(whole)) if len(whole) else 0.0
        return LogColumn(name, "s", np.asarray(whole - first, np.float64) * 1e-9)
    return LogColumn(name, unit, np.asarray(data.to_numpy(), np.float64))
