"""A journal in the formats of other tools, by the ending of the file.

| ending | holds | read by |
|---|---|---|
| .rec | everything | this program |
| .csv .npz .parquet .mf4 | signals and channels | spreadsheets, numpy, pandas, asammdf |
| .blf .asc .log | frames; a DBC file beside them | Vector's tools, cantools, can-utils |
"""

import csv
import importlib
import itertools
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.bus import frame_log
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.recording import SUFFIX, journal, messages
from hil_emulator.recording.journal import EntryKind

_BATCH = 4096  # rows handled at once
_EXTRAS = {".parquet": "pyarrow", ".mf4": "asammdf"}
_EXTRA = "hil-emulator[recording]"


def check_file(file: Path) -> None:
    """Refuse a file that cannot be written, before the run.

    Raises:
        UserError: for an unknown ending, a folder that is not there or a missing extra.

    """
    known = (SUFFIX, *_WRITERS, *frame_log.SUFFIXES)
    if file.suffix not in known:
        raise UserError(f"{file}: unknown ending; a recording ends in {', '.join(known)}")
    if not file.parent.is_dir():
        raise UserError(f"{file}: the folder {file.parent} does not exist; make it first")
    if file.suffix in _EXTRAS:
        _module(file)


def export(source: Path, file: Path) -> None:
    """Write a journal in the format of the file's ending.

    Raises:
        UserError: if the journal cannot be read or the file cannot be written.

    """
    check_file(file)
    try:
        if file.suffix == SUFFIX:
            if file != source:
                file.write_bytes(source.read_bytes())
        elif file.suffix in _WRITERS:
            _WRITERS[file.suffix](source, file)
        else:
            _export_frames(source, file)
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror or error}") from None


def header_of(source: Path) -> dict[str, Any]:
    """Return a journal's header."""
    for kind, payload in journal.entries(source):
        if kind is EntryKind.HEADER:
            return dict(json.loads(payload))
    raise UserError(f"{source}: empty; it ended before anything was written")


def _module(file: Path) -> Any:
    """Import what a format needs, or say what to install."""
    name = _EXTRAS[file.suffix]
    try:
        return importlib.import_module(name)
    except ImportError:
        raise UserError(
            f"{file}: needs {name}, which is not installed; pip install '{_EXTRA}'"
        ) from None


def _batches(source: Path) -> Iterator[np.ndarray[Any, np.dtype[np.float64]]]:
    """Yield rows in batches, shape (rows, columns)."""
    width = len(header_of(source)["columns"])
    rows = (payload for kind, payload in journal.entries(source) if kind is EntryKind.ROW)
    while batch := list(itertools.islice(rows, _BATCH)):
        yield np.frombuffer(b"".join(batch)).reshape(-1, width)


def _export_csv(source: Path, file: Path) -> None:
    header = header_of(source)
    with file.open("w", newline="", encoding="utf-8") as out:
        out.writelines(f"# {key}: {value}\n" for key, value in header["provenance"].items())
        writer = csv.writer(out)
        writer.writerow([f"{name} [{unit}]" for name, unit in header["columns"].items()])
        for batch in _batches(source):
            writer.writerows([f"{value:.9g}" for value in row] for row in batch.tolist())


def _export_npz(source: Path, file: Path) -> None:
    recording = journal.read(source)
    units = {"units": np.array(list(recording.units.items()))}
    origin = {"provenance": np.array(list(recording.provenance.items()))}
    np.savez_compressed(file, **recording.table(), **units, **origin)  # type: ignore[arg-type]


def _export_parquet(source: Path, file: Path) -> None:
    pyarrow = _module(file)
    parquet = importlib.import_module("pyarrow.parquet")
    header = header_of(source)
    fields = [
        pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit})
        for name, unit in header["columns"].items()
    ]
    schema = pyarrow.schema(fields, metadata=header["provenance"])
    with parquet.ParquetWriter(file, schema) as writer:
        for batch in _batches(source):
            columns = [pyarrow.array(column) for column in batch.T]
            writer.write_table(pyarrow.Table.from_arrays(columns, schema=schema))


def _export_mf4(source: Path, file: Path) -> None:
    asammdf = _module(file)
    recording = journal.read(source)
    table = recording.table()
    time = table.pop("time")
    signals = [
        asammdf.Signal(values.copy(), time, name=name, unit=recording.units[name])
        for name, values in table.items()
    ]
    with asammdf.MDF(version="4.10") as mdf:
        mdf.header.comment = json.dumps(recording.provenance)
        mdf.append(signals, comment="hil-emulator", common_timebase=True)
        mdf.save(file, overwrite=True)


def _export_frames(source: Path, file: Path) -> None:
    # cantools takes half a second, and a run only asks here whether its files can be written
    from hil_emulator.export.can_database import dbc

    header = header_of(source)
    remarks = [f"{key}: {value}" for key, value in header["provenance"].items()]
    frame_log.write(file, _frames(source), remarks)
    database = dbc(messages.from_json(header["messages"]), header["sync_ms"])
    file.with_suffix(".dbc").write_text(database, encoding="latin-1", newline="\r\n")
    if file.suffix == ".log":  # candump's format has no room for remarks
        beside = file.with_name(file.name + ".json")
        beside.write_text(json.dumps(header["provenance"], indent=2), encoding="utf-8")


def _frames(source: Path) -> Iterator[tuple[int, bool, Frame]]:
    for kind, payload in journal.entries(source):
        if kind is EntryKind.BUS:
            yield from journal.frames_of(payload)


_WRITERS: dict[str, Callable[[Path, Path], None]] = {
    ".csv": _export_csv,
    ".npz": _export_npz,
    ".parquet": _export_parquet,
    ".mf4": _export_mf4,
}
