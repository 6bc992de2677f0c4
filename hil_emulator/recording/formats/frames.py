"""BLF, ASC, candump's log: the frames, and a DBC; for Vector's tools and cantools."""

import json
from pathlib import Path

from hil_emulator.bus import frame_log, log_endings
from hil_emulator.recording import messages
from hil_emulator.recording.format import Format
from hil_emulator.recording.streaming import frames, header_of


def write(source: Path, file: Path) -> None:
    """Write the frames, and their meaning."""
    # imported late: cantools takes half a second, and a run only checks its files
    from hil_emulator.export.can_database import dbc

    header = header_of(source)
    remarks = [f"{key}: {value}" for key, value in header["provenance"].items()]
    frame_log.write(file, frames(source), remarks)
    meanings = messages.from_json([*header["messages"], *header.get("services", [])])
    database = dbc(meanings, header["sync_ms"])
    _database(file).write_text(database, encoding="latin-1", newline="\r\n")
    for origin in _origin(file):
        origin.write_text(json.dumps(header["provenance"], indent=2), encoding="utf-8")


def companions(file: Path) -> tuple[Path, ...]:
    """Return the further files."""
    return (_database(file), *_origin(file))


def _database(file: Path) -> Path:
    return file.with_suffix(".dbc")


def _origin(file: Path) -> tuple[Path, ...]:
    """Return the file for remarks, which candump's format cannot hold."""
    return (file.with_name(file.name + ".json"),) if file.suffix == ".log" else ()


FORMAT = Format(log_endings.SUFFIXES, write, companions=companions)
