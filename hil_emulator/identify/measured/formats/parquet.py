"""Apache Parquet: columns named `name [unit]`, or with their unit as metadata of the field."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np

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
        with storage.ParquetFile(file) as source:  # one file, whatever folders are called
            table = source.read()
        found = [_column(arrow, field, table.column(i)) for i, field in enumerate(table.schema)]
    except Exception as error:  # pyarrow answers damage with many kinds of exception
        raise UserError(f"{file}: is not a readable Parquet file: {error}") from None
    own = OWN_MARK in (table.schema.metadata or {})
    return LogTable(tuple(c for c in found if c is not None), set_point_first=own)


def _column(arrow: Any, field: Any, data: Any) -> LogColumn | None:
    """Return a column, or None for one that holds neither numbers nor times."""
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
    if arrow.types.is_integer(field.type) or arrow.types.is_floating(field.type):
        return LogColumn(name, unit, np.asarray(data.to_numpy(), np.float64))
    return None
