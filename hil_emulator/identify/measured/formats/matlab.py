"""MATLAB files (.mat): vectors by name, alone or as fields of a structure, or one matrix.

Names cannot hold a unit, so it is their end, as in `position_mm`, or the text of that name in a
structure `units`.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.formats.table import H5PY, LogColumn, LogTable, label, module

UNITS = "units"
"""Structure whose texts are the units of the vectors of the same names."""

CLOCKS = ("time", "t", "tout", "Time")
"""Vectors that are the time in seconds where nothing states a unit, as of Simulink."""

OWN_MARK = "provenance"
"""Structure in a file that the emulator has written."""


def read(file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Read all vectors of numbers.

    Args:
        file: the file.
        headings: names and units of the columns of a matrix.

    Raises:
        UserError: if it is no such file, holds no vectors, or is of version 7.3 and h5py is not
            installed.

    """
    try:
        content = loadmat(file, squeeze_me=True, simplify_cells=True)
    except NotImplementedError:  # version 7.3 is HDF5
        content = _hdf5(file)
    except Exception as error:  # scipy answers a damaged file with many kinds of exception
        raise UserError(f"{file}: is not a readable MATLAB file: {error}") from None
    units = content.pop(UNITS, {})
    of_emulator = content.pop(OWN_MARK, None) is not None
    if of_emulator:
        content.pop("model", None)  # signals of the model, which no sensor measures
    arrays = dict(_numbers(content))
    if headings:
        return LogTable(_matrix(file, arrays, headings), notes=("columns by --columns",))
    vectors = {n: v for n, v in arrays.items() if v.ndim == 1 and len(v) > 1}
    if not vectors:
        raise UserError(
            f"{file}: holds no vectors; name the columns of a matrix, such as "
            '--columns "time [s],position [mm]"'
        )
    stated = units if isinstance(units, Mapping) else {}
    lengths = [len(v) for v in vectors.values()]
    usual = max(set(lengths), key=lengths.count)
    columns = tuple(
        LogColumn(n, (str(stated[n]) or "1") if n in stated else None, v)
        for n, v in vectors.items() if len(v) == usual
    )  # fmt: skip
    return _with_seconds(LogTable(columns, set_point_first=of_emulator or None))


def _with_seconds(table: LogTable) -> LogTable:
    """Return a table whose time is in seconds if its name has no unit."""
    bare = [c.name for c in table.columns if c.unit is None and c.name in CLOCKS]
    if len(bare) != 1 or any(c.name == "time" for c in table.columns if c.name not in bare):
        return table
    columns = tuple(
        replace(c, name="time", unit="s") if c.name == bare[0] else c for c in table.columns
    )
    return replace(table, columns=columns, notes=(f"{bare[0]} is taken for the time in s",))


def _numbers(content: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield names and arrays of numbers, those of structures too."""
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _numbers(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "iufb":
            yield name, np.asarray(value, np.float64)


def _matrix(
    file: Path, arrays: Mapping[str, Any], headings: Sequence[str]
) -> tuple[LogColumn, ...]:
    width = len(headings)
    fitting = [a for a in arrays.values() if a.ndim == 2 and width in a.shape]
    if len(fitting) != 1:
        raise UserError(f"{file}: {len(fitting)} matrices have the {width} columns of --columns")
    matrix = fitting[0] if fitting[0].shape[1] == width else fitting[0].T
    heads = (label(h) for h in headings)
    return tuple(LogColumn(n, u, matrix[:, i].copy()) for i, (n, u) in enumerate(heads))


def _hdf5(file: Path) -> dict[str, Any]:
    """Return the content of a file of version 7.3."""
    h5py = module(H5PY, file)

    left = itertools.repeat(None, input_files.MEMBERS)

    def content(group: Any) -> dict[str, Any]:
        """Return what is in a group; links may lead to the same one by many ways."""
        if next(left, "") is not None:
            raise ValueError(f"has more than {input_files.MEMBERS} groups")
        return {n: _dataset(v) if isinstance(v, h5py.Dataset) else content(v)
                for n, v in group.items() if not n.startswith("#")}  # fmt: skip

    try:
        with h5py.File(file) as source:
            input_files.check_unpacked(file, _stated(h5py, source))
            return content(source)
    except UserError:
        raise
    except Exception as error:  # h5py, too, answers with many kinds
        raise UserError(f"{file}: is not a readable MATLAB file: {error}") from None


def _stated(h5py: Any, source: Any) -> int:
    """Return how many bytes all values have as numbers, as the file states it."""
    sizes: list[int] = []

    def add(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            sizes.append(int(item.size or 0) * max(8, item.dtype.itemsize))

    source.visititems(add)
    return sum(sizes)


def _dataset(data: Any) -> Any:
    value = np.squeeze(np.asarray(data[()]))
    if data.attrs.get("MATLAB_class") == b"char":
        return "".join(chr(c) for c in np.atleast_1d(value))
    return value.T if value.ndim == 2 else value
