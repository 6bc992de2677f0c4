"""Frames in texts that python-can does not read: candump's screen, BusMaster, tables of frames.

candump's screen, with or without `-t a|A|d|z`, `-x` and `-a`, is parsed by cantools, and so is a
PCAN trace of version 1.2.
"""

import re
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from cantools.logreader import Parser

from hil_emulator.bus.frame_log import MOST_FRAMES, Captured
from hil_emulator.bus.log_content import beginning, cells, is_frame_header, place_of
from hil_emulator.bus.text_lines import REMARKS, Lines
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame

_NS = 1_000_000_000

_DIRECTION = re.compile(r"(\s)[RT]X [B-] [E-]\s+")
"""Direction and flags, which `candump -x` adds to a line."""

_BUSMASTER = re.compile(
    r"^(?P<time>\d+:\d+:\d+:\d+)\s+[RT]x\s+(?P<channel>\S+)\s+0x(?P<id>[0-9A-Fa-f]+)\s+"
    r"(?P<kind>s|x|sr|xr)\s+(?P<length>\d+)(?P<data>(?:\s+[0-9A-Fa-f]{2})*)\s*$"
)
"""A frame in BusMaster's log; the last part of its time counts 0.1 ms."""

_DELTAS = 0.05
"""Share of decreasing times from which the times are steps from frame to frame (assumed)."""

_MICROSECONDS = 1e-6

_UNITS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


def is_one(file: Path, kind: str) -> bool:
    """Return whether a log is a text of frames that python-can does not read."""
    if kind == ".trc":
        return b"FILEVERSION=1.2" in beginning(file)
    return kind in ("screen", "busmaster", "table")


def read(file: Path, kind: str) -> list[Captured]:
    """Return the frames of a text.

    Args:
        file: text file.
        kind: format of the text, see `log_content.content`.

    Raises:
        UserError: if a line cannot be read, or the log has no times.

    """
    lines = Lines(file)
    readers: dict[str, Callable[[Lines], Iterator[Captured]]] = {
        "busmaster": _busmaster,
        "table": _table,
    }
    try:
        frames = []
        for frame in readers.get(kind, _by_cantools)(lines):
            frames.append(frame)
            if len(frames) > MOST_FRAMES:
                raise UserError(f"{file}: has more than {MOST_FRAMES} frames; cut it")
    except (ValueError, IndexError, OverflowError):
        raise lines.trouble("cannot be read as a frame") from None
    finally:
        lines.close()
    if not frames:
        raise UserError(f"{file}: no line of it is a frame")
    return _cumulated(frames)


def _by_cantools(lines: Lines) -> Iterator[Captured]:
    parser = Parser(tz=UTC)
    for line in lines:
        plain = _DIRECTION.sub(r"\1", line.rstrip("\r\n"), count=1)
        entry = parser.parse(plain)
        if entry is None:
            if plain.strip() and not plain.lstrip().startswith(REMARKS) and "ERROR" not in plain:
                raise ValueError(line)
            continue
        if entry.timestamp is None:
            raise lines.trouble("has no time; log with candump -L, or show times with -t z")
        frame = Frame(entry.frame_id, entry.data, entry.is_remote_frame, entry.is_extended_frame)
        yield Captured(_nanoseconds(entry.timestamp), frame, entry.channel)


def _nanoseconds(time: datetime | timedelta) -> int:
    if isinstance(time, timedelta):
        return time // timedelta(microseconds=1) * 1000
    aware = time if time.tzinfo else time.replace(tzinfo=UTC)
    return (aware - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000


def _busmaster(lines: Lines) -> Iterator[Captured]:
    for line in lines:
        if line.startswith("***") or not line.strip():
            continue
        match = _BUSMASTER.match(line)
        if match is None:
            raise ValueError(line)
        hours, minutes, seconds, part = match["time"].split(":")
        whole = (int(hours) * 60 + int(minutes)) * 60 + int(seconds)
        now_ns = round((whole + int(part) / 10 ** len(part)) * _NS)
        kind, data = match["kind"], bytes.fromhex(match["data"])
        frame = Frame(int(match["id"], 16), data, "r" in kind, "x" in kind)
        yield Captured(now_ns, frame, match["channel"])


def _table(lines: Lines) -> Iterator[Captured]:
    """Yield the rows of a table of frames, as SavvyCAN, CANalyzer and others export them."""
    names: list[str] = []
    for line in lines:
        names = cells(line)
        if is_frame_header(names):
            break
    time, identifier, data = (place_of(names, what) for what in ("time", "id", "data"))
    unit, lower = _time_unit(names[time]), [n.lower() for n in names]
    extended = next((i for i, n in enumerate(lower) if n in ("extended", "ide", "ext")), None)
    channel = next((i for i, n in enumerate(lower) if n in ("bus", "channel", "chn", "ch")), None)
    remote = next((i for i, n in enumerate(lower) if n in ("rtr", "remote")), None)
    length = next((i for i, n in enumerate(lower) if n in ("len", "length", "dlc", "size")), None)
    for line in lines:
        row = cells(line)
        if not any(row) or line.startswith(REMARKS):
            continue
        text = row[identifier].lower().removeprefix("0x")
        can_id = int(text.rstrip("xh"), 16)
        size = int(row[length]) if length is not None else None
        frame = Frame(
            can_id,
            _bytes(row[data:], size),
            remote is not None and _is_true(row[remote]),
            _is_true(row[extended]) if extended is not None else can_id > 0x7FF or "x" in text,
        )
        where = row[channel] if channel is not None else ""
        yield Captured(round(float(row[time].replace(",", ".")) * unit * _NS), frame, where)


def _time_unit(name: str) -> float:
    """Return the unit of a time stamp [s]; SavvyCAN's column has no unit."""
    words = re.findall(r"[a-zµ]+", name.lower())
    stated = next((_UNITS[w] for w in words if w in _UNITS), None)
    if stated is not None:
        return stated
    return _MICROSECONDS if words == ["time", "stamp"] else 1.0


def _is_true(cell: str) -> bool:
    return cell.strip().lower() in ("1", "true", "yes", "x")


def _bytes(row: list[str], size: int | None) -> bytes:
    """Return the data, which stand in one cell or in one cell per byte."""
    digits = " ".join(cell.removeprefix("0x") for cell in row if cell)
    if " " in row[0].strip() or len(row) == 1 or len(row[0]) > 2:  # in one cell
        digits = row[0].lower().removeprefix("0x")
    data = bytes.fromhex(" ".join(d.zfill(2) if len(d) == 1 else d for d in digits.split()))
    return data if size is None else data[:size]


def _cumulated(frames: list[Captured]) -> list[Captured]:
    """Return frames with absolute times if each was logged with the time since the frame before."""
    times = np.array([frame.now_ns for frame in frames])
    if np.mean(np.diff(times) < 0) < _DELTAS:
        return frames
    return [
        frame._replace(now_ns=int(now)) for frame, now in zip(frames, np.cumsum(times), strict=True)
    ]
