"""The journal: a recording as a stream of entries, each complete in itself.

    file    MAGIC, entry, entry, ...
    entry   kind (1 byte), size of the payload (4 bytes), payload; little-endian

Whatever ends the writing, all complete entries stay readable. The first one is the header.

| kind | payload |
|---|---|
| HEADER | JSON: provenance, columns with units, messages of the nodes, period of SYNC |
| ROW | float64 per column |
| BUS | time [ns], 1 where the emulator sent them, then per frame: COB-ID, flags, length, 8 bytes |
| EVENT | time [ns], JSON: a fault, its end, a setting, how far time has slipped [ns] |
"""

import json
import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.input_files import RECORDING, RECORDING_IN_PARTS, Limit, parse_json
from hil_emulator.recording import SUFFIX
from hil_emulator.recording.header_shape import LARGEST, header_of_entry

_NAME = b"HILREC"
MAGIC = _NAME + b"2\n"
_READABLE = (_NAME + b"1\n", MAGIC)

_ENTRY = struct.Struct("<BI")
_BUS = struct.Struct("<qB")
_FRAME = struct.Struct("<IBB8s")
_TIME = struct.Struct("<q")
_REMOTE, _EXTENDED = 1, 2
_LARGEST_ID, _DATA_BYTES = 0x1FFF_FFFF, 8  # of a classical frame (ISO 11898-1)


NOT_BEGUN = {"kind": "not begun"}
"""Event of a run that ended before its first tick; its recording is not kept."""


class EntryKind(IntEnum):
    """Kind of an entry."""

    HEADER = 0
    ROW = 1
    BUS = 2
    EVENT = 3


def entry(kind: EntryKind, payload: bytes) -> bytes:
    """Return an entry's bytes."""
    return _ENTRY.pack(kind, len(payload)) + payload


def bus_entry(now_ns: int, frames: Iterable[Frame], *, sent: bool) -> bytes:
    """Return the entry of frames that were on the bus together."""
    packed = [
        _FRAME.pack(f.can_id, _REMOTE * f.remote + _EXTENDED * f.extended, len(f.data), f.data)
        for f in frames
    ]
    return entry(EntryKind.BUS, _BUS.pack(now_ns, sent) + b"".join(packed))


def event_entry(now_ns: int, what: Mapping[str, Any]) -> bytes:
    """Return the entry of an action on the rig."""
    return entry(EntryKind.EVENT, _TIME.pack(now_ns) + json.dumps(what).encode())


def header_entry(header: Mapping[str, Any]) -> bytes:
    """Return the beginning of a journal."""
    return MAGIC + entry(EntryKind.HEADER, json.dumps(header).encode())


@dataclass
class Recording:
    """A recording in memory.

    Attributes:
        header: see the table above.
        rows: values, shape (ticks, columns).
        frames: time [ns], whether the emulator sent it, frame; oldest first.
        events: time [ns] and description of each action on the rig.

    """

    header: dict[str, Any]
    rows: np.ndarray[Any, np.dtype[np.float64]]
    frames: list[tuple[int, bool, Frame]] = field(default_factory=list)
    events: list[tuple[int, dict[str, Any]]] = field(default_factory=list)

    @property
    def units(self) -> dict[str, str]:
        """Units by column name."""
        return dict(self.header["columns"])

    @property
    def provenance(self) -> dict[str, str]:
        """Origin of the data: version, configuration, digest, seed."""
        return dict(self.header["provenance"])

    def table(self) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
        """Return values over time by column name."""
        return {name: self.rows[:, i] for i, name in enumerate(self.units)}


def entries(file: Path, limit: Limit = RECORDING_IN_PARTS) -> Iterator[tuple[EntryKind, bytes]]:
    """Yield the complete entries of a journal, the header first.

    Args:
        file: the file.
        limit: of its size.

    Raises:
        UserError: if the file is not a journal, cannot be read or is damaged.

    """
    try:
        input_files.check(file, limit)
        with file.open("rb") as stream:
            begins = stream.read(len(MAGIC))
            if begins not in _READABLE and begins.startswith(_NAME):
                raise UserError(f"{file}: of another version of this program; export it with that")
            if begins not in _READABLE:
                raise UserError(f"{file}: not a recording of this program; name a {SUFFIX} file")
            size = os.fstat(stream.fileno()).st_size
            width: int | None = None
            while (following := _next_entry(stream, size)) is not None:
                kind, payload = following
                if width is None and kind == EntryKind.HEADER:
                    width = len(header_of_entry(file, payload)["columns"])
                elif width is None or not _is_sound(kind, payload, width):
                    raise UserError(f"{file}: damaged before byte {stream.tell()}")
                yield EntryKind(kind), payload
    except (OSError, ValueError) as error:  # Python raises ValueError for an invalid name
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"{file}: cannot be read: {reason}; name a recording (.rec)") from None


def has_begun(file: Path) -> bool:
    """Return whether the run of a journal had a tick.

    Raises:
        UserError: as `entries`.

    """
    first = list(islice(entries(file), 2))
    return first[1:] != list(split(event_entry(0, NOT_BEGUN)))


def split(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield kind and payload of the entries in bytes that hold complete ones."""
    at = 0
    while at < len(data):
        kind, length = _ENTRY.unpack_from(data, at)
        at += _ENTRY.size
        yield kind, data[at : at + length]
        at += length


def _next_entry(stream: BinaryIO, size: int) -> tuple[int, bytes] | None:
    """Return kind and payload of the next entry; None at the end of a file of that size."""
    head = stream.read(_ENTRY.size)
    if len(head) < _ENTRY.size:
        return None
    kind, length = _ENTRY.unpack(head)
    if stream.tell() + length > size:
        return None
    return kind, stream.read(length)


def _is_sound(kind: int, payload: bytes, width: int) -> bool:
    """Return whether an entry after the header is valid in a journal with so many columns."""
    match kind:
        case EntryKind.ROW:
            return len(payload) == 8 * width
        case EntryKind.BUS:
            if len(payload) < _BUS.size or (len(payload) - _BUS.size) % _FRAME.size:
                return False
            frames = _FRAME.iter_unpack(payload[_BUS.size :])
            timely = _BUS.unpack_from(payload)[0] >= 0
            return timely and all(f[0] <= _LARGEST_ID and f[2] <= _DATA_BYTES for f in frames)
        case EntryKind.EVENT:
            try:
                what = parse_json(payload[_TIME.size :]) if len(payload) <= LARGEST else None
            except ValueError:
                return False
            return isinstance(what, dict) and _TIME.unpack_from(payload)[0] >= 0
    return False


def frames_of(payload: bytes) -> Iterator[tuple[int, bool, Frame]]:
    """Yield time, direction and frame of a BUS entry."""
    now_ns, sent = _BUS.unpack_from(payload)
    for can_id, flags, length, data in _FRAME.iter_unpack(payload[_BUS.size :]):
        frame = Frame(can_id, data[:length], bool(flags & _REMOTE), bool(flags & _EXTENDED))
        yield now_ns, bool(sent), frame


def event_of(payload: bytes) -> tuple[int, dict[str, Any]]:
    """Return time and content of an EVENT entry."""
    return _TIME.unpack_from(payload)[0], json.loads(payload[_TIME.size :])


def read(file: Path) -> Recording:
    """Return a whole recording.

    Raises:
        UserError: if the file is not a journal, or ends within its header.

    """
    header: dict[str, Any] | None = None
    rows: list[bytes] = []
    frames: list[tuple[int, bool, Frame]] = []
    events: list[tuple[int, dict[str, Any]]] = []
    for kind, payload in entries(file, RECORDING):
        match kind:
            case EntryKind.HEADER:
                header = header_of_entry(file, payload)
            case EntryKind.ROW:
                rows.append(payload)
            case EntryKind.BUS:
                frames += frames_of(payload)
            case EntryKind.EVENT:
                events.append(event_of(payload))
    if header is None:
        raise UserError(f"{file}: empty; it ended before anything was written")
    width = len(header["columns"])
    table = np.frombuffer(b"".join(rows)).reshape(-1, width)
    return Recording(header, table, frames, events)


def write(recording: Recording, file: Path) -> None:
    """Write a recording as a journal, into a new file.

    Raises:
        UserError: if the file exists or cannot be written.

    """
    try:
        with file.open("xb") as stream:
            stream.write(header_entry(recording.header))
            for now_ns, what in recording.events:
                stream.write(event_entry(now_ns, what))
            for now_ns, sent, frame in recording.frames:
                stream.write(bus_entry(now_ns, [frame], sent=sent))
            for row in recording.rows:
                stream.write(entry(EntryKind.ROW, row.tobytes()))
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror}") from None
