"""BLF, ASC, candump's log, pcapng: frames and a DBC; for Vector's tools, Wireshark, cantools."""

import json
from pathlib import Path

from hil_emulator.bus import frame_log, log_endings
from hil_emulator.recording import messages
from hil_emulator.recording.format import Format
from hil_emulator.recording.header_shape import DIRECTIONS
from hil_emulator.recording.streaming import frames, header_of


def write(source: Path, file: Path, *, directions: bool = False) -> None:
    """Write the frames, and their meaning.

    Args:
        source: the journal.
        file: where to.
        directions: see `frame_log.write`; also where the recording was made so.

    """
    # imported late: cantools takes half a second, and a run only checks its files
    from hil_emulator.export.can_database import dbc

    header = header_of(source)
    remarks = [f"{key}: {value}" for key, value in header["provenance"].items()]
    directions = directions or header.get(DIRECTIONS, False)
    frame_log.write(file, frames(source), remarks, directions=directions)
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


def _directed(source: Path, file: Path) -> None:
    """Write the same with the direction of each frame in candump's log."""
    write(source, file, directions=True)


FORMAT = Format(log_endings.SUFFIXES, write, companions=companions, directed=_directed)
