"""Frames in the log files of other tools, by python-can's own readers and writers."""

import io
import re
import struct
import zlib
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import can

from hil_emulator import input_files
from hil_emulator.bus import pcapng
from hil_emulator.bus.in_process import as_frame, as_message
from hil_emulator.bus.log_content import content
from hil_emulator.bus.text_lines import Cumulated, Lines, candump_line
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame

_OBJECT, _HEADER = b"LOBJ", 16
"""Signature of an object in a BLF file, and size of its shortest header [B]."""

_CONTAINER = struct.Struct("<4s4xIIH14x")
"""Beginning of a container: signature, size, kind, method of compression."""

_PACKED = (10, 2)
"""Kind of a container, and the compression method of zlib."""

LARGEST_CONTAINER = 64 * input_files.MIB
"""Unpacked size of a container [B]; Vector's tools write 128 KiB (assumed)."""

MOST_FRAMES = 10_000_000
"""Most frames of a log: over an hour at 2,000 per second, 2.5 GB of memory (assumed)."""

_WAY = re.compile(r" [RT]\n$")
_NS_PER_S = 1e9
_LATEST_S = 4e9  # of a time in a log [s]: since 1970, until 2096 (assumed)
_CHANNEL = "can0"
_MARKED = (".blf", ".asc")
"""Formats that can contain a remark."""


def write(
    file: Path, frames: Iterable[tuple[int, bool, Frame]], remarks: Iterable[str],
    *, directions: bool = False,
) -> None:  # fmt: skip
    """Write frames on the emulator's time base.

    Args:
        file: output file; its ending, one of `log_endings.SUFFIXES`, decides the format.
        frames: time [ns], whether the emulator sent the frame, and frame; oldest first.
        remarks: origin of the data; written at time 0 if the format can contain remarks.
        directions: whether each line of candump's format ends in R or T; only can-utils read it.

    """
    if file.suffix == ".pcapng":
        with pcapng.Writer(file, "\n".join(remarks)) as packets:
            for now_ns, sent, frame in frames:
                stamp = now_ns / _NS_PER_S
                message = as_message(frame, timestamp=stamp, channel=0, is_rx=not sent)
                packets.write(now_ns, message)
        return
    text = file.suffix == ".log"
    bare = text and not directions
    with can.CanutilsLogWriter(_Undirected(file)) if bare else can.Logger(str(file)) as logger:
        writer: Any = logger
        if file.suffix in _MARKED:
            for remark in remarks:
                writer.log_event(remark, 0.0)
        for now_ns, sent, frame in frames:
            logger(
                as_message(
                    frame,
                    timestamp=now_ns / _NS_PER_S,
                    channel=_CHANNEL if text else 0,
                    is_rx=not sent,
                )
            )


class _Undirected(io.TextIOWrapper):
    """A text file without the direction that python-can writes at the end of each line."""

    def __init__(self, file: Path) -> None:
        super().__init__(file.open("wb"), encoding="ascii", newline="\n")

    def write(self, text: str) -> int:
        """Write a line without its direction."""
        return super().write(_WAY.sub("\n", text))


def read(file: Path, tick_ns: int) -> Iterator[tuple[int, bool, Frame]]:
    """Yield the frames of a log, with times rounded to ticks.

    Raises:
        UserError: if it cannot be read.

    """
    for message in _messages(file):
        now_ns = round(message.timestamp * _NS_PER_S / tick_ns) * tick_ns
        yield now_ns, not message.is_rx, as_frame(message)


class Captured(NamedTuple):
    """A frame of a capture.

    Attributes:
        now_ns: time stamp [ns].
        frame: classical CAN or CAN FD frame.
        channel: name of the channel as in the log's format.

    """

    now_ns: int
    frame: Frame
    channel: str


def captured(file: Path) -> Iterator[Captured]:
    """Yield the frames of a capture, CAN FD frames included.

    Raises:
        UserError: if it cannot be read.

    """
    first = 1 if kind_of(file) in _FROM_ZERO else 0
    for m in _messages(file, fd=True):
        channel = str(m.channel + first if isinstance(m.channel, int) else m.channel or "")
        yield Captured(round(m.timestamp * _NS_PER_S), _whole(m), channel)


def _whole(m: can.Message) -> Frame:
    """Return a message with all its data, up to 64 bytes with CAN FD."""
    if m.is_fd:
        return Frame(m.arbitration_id, bytes(m.data), m.is_remote_frame, m.is_extended_id)
    return as_frame(m)


def kind_of(file: Path) -> str:
    """Return the ending of a log's format in python-can: by content if possible, else by name.

    Raises:
        UserError: if it cannot be read.

    """
    try:
        return content(file) or file.suffix.lower()
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror or error}") from None


def _messages(file: Path, *, fd: bool = False) -> Iterator[can.Message]:
    """Yield the classical CAN messages of a log, and with `fd` also the CAN FD messages."""
    lines: list[Lines] = []
    try:
        input_files.check(file, input_files.CAPTURE)
        with closing(_reader(file, lines)) as reader:
            for number, message in enumerate(reader):
                if number >= MOST_FRAMES:
                    raise UserError(f"{file}: has more than {MOST_FRAMES} frames; cut it")
                if not abs(message.timestamp) <= _LATEST_S:
                    raise ValueError(f"a frame has the time {message.timestamp:g} s")
                if not message.is_error_frame and (fd or not message.is_fd):
                    yield message
    except UserError:
        raise
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror or error}") from None
    except (
        Exception
    ) as error:  # python-can's readers raise many kinds of exception for a damaged file
        if lines:
            raise lines[0].trouble("cannot be read as a frame") from None
        raise UserError(f"{file}: is not a readable log of frames: {error}") from None


def _reader(file: Path, lines: list[Lines]) -> Generator[can.Message, None, None]:
    """Yield the messages of python-can's reader; `lines` receives the lines of a text."""
    kind = kind_of(file)
    if kind == ".pcapng":
        yield from pcapng.messages(file)
        return
    if kind in _TEXTS:
        reader, kept = _TEXTS[kind]
        lines.append(Lines(file, kept()))
        with reader(lines[0]) as text:
            yield from text
        return
    if kind == ".blf":
        binary: Any = _BoundedBlfReader(file)
    else:
        binary = can.SqliteReader(str(file)) if kind == ".db" else can.LogReader(str(file))
    with binary:
        yield from binary


def _unchanged(line: str) -> str:
    return line


_TEXTS: dict[str, tuple[Any, Callable[[], Callable[[str], str]]]] = {
    ".asc": (can.ASCReader, Cumulated),
    ".log": (can.CanutilsLogReader, lambda: candump_line),
    ".trc": (can.TRCReader, lambda: _unchanged),
    ".csv": (can.CSVReader, lambda: _unchanged),
}
"""python-can's readers of texts by ending, and the factory of their line filter."""

_FROM_ZERO = (".asc", ".blf")
"""Formats whose channels count from 0 in python-can and from 1 in Vector's tools."""


class _BoundedBlfReader(can.BLFReader):
    """Reads a BLF file whose containers unpack to bounded sizes and whose objects have a size.

    The base class unpacks a container of any size, and loops for ever at an object of size 0.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(str(file))
        self._most = input_files.largest_unpacked(file)

    def __iter__(self) -> Generator[can.Message, None, None]:
        begin = self.file.tell()
        self._check_containers()
        self.file.seek(begin)
        yield from super().__iter__()

    def _check_containers(self) -> None:
        unpacked = 0
        while len(header := self.file.read(_CONTAINER.size)) == _CONTAINER.size:
            signature, size, kind, method = _CONTAINER.unpack(header)
            if signature != _OBJECT or size < _CONTAINER.size:
                return  # the base class reports the error
            packed = self.file.read(size - _CONTAINER.size + size % 4)
            if (kind, method) == _PACKED:
                unpacker = zlib.decompressobj()
                unpacked += len(unpacker.decompress(packed, LARGEST_CONTAINER))
                if unpacker.unconsumed_tail or unpacked > self._most:
                    raise ValueError(
                        f"a container unpacks to more than {LARGEST_CONTAINER} bytes, or all "
                        f"to more than {self._most}"
                    )

    def _parse_data(self, data: bytes) -> Iterator[can.Message]:
        at = data.find(_OBJECT, 0, 8)
        while 0 <= at <= len(data) - _HEADER:
            (size,) = struct.unpack_from("<I", data, at + 8)
            if size < _HEADER:
                raise ValueError(f"an object states a size of {size} bytes")
            at = data.find(_OBJECT, at + size, at + size + 8)
        yield from super()._parse_data(data)
