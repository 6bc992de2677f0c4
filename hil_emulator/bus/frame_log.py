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
"""What an object of a BLF file begins with, and the bytes of its shortest header."""

_CONTAINER = struct.Struct("<4s4xIIH14x")
"""Beginning of a container: signature, size, kind, method of compression."""

_PACKED = (10, 2)
"""Kind of a container, and the method of one that zlib has packed."""

LARGEST_CONTAINER = 64 * input_files.MIB
"""Unpacked size of a container [B]; Vector's tools write 128 KiB (assumed)."""

MOST_FRAMES = 10_000_000
"""Frames of a log: over an hour of 2,000 a second, in 2.5 GB of memory (assumed)."""

_WAY = re.compile(r" [RT]\n$")
_NS_PER_S = 1e9
_LATEST_S = 4e9  # of a time in a log [s]: since 1970, until 2096 (assumed)
_CHANNEL = "can0"
_MARKED = (".blf", ".asc")
"""Formats that can hold a remark."""


def write(
    file: Path, frames: Iterable[tuple[int, bool, Frame]], remarks: Iterable[str],
    *, directions: bool = False,
) -> None:  # fmt: skip
    """Write frames on the emulator's time base.

    Args:
        file: where to; its ending, one of `log_endings.SUFFIXES`, decides the format.
        frames: time [ns], whether the emulator sent it, frame; oldest first.
        remarks: what made the data; written at time 0, where the format can hold it.
        directions: whether each line of candump's format ends in R or T, which tools other than
            can-utils do not expect.

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
    """A text file in which no line ends in the direction that python-can writes."""

    def __init__(self, file: Path) -> None:
        super().__init__(file.open("wb"), encoding="ascii", newline="\n")

    def write(self, text: str) -> int:
        """Write a line."""
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
        now_ns: its time [ns].
        frame: the frame, which may be one of CAN FD.
        channel: where it came from, as the log's own tools call it.

    """

    now_ns: int
    frame: Frame
    channel: str


def captured(file: Path) -> Iterator[Captured]:
    """Yield the frames of a capture, whose frames may be those of CAN FD.

    Raises:
        UserError: if it cannot be read.

    """
    first = 1 if kind_of(file) in _FROM_ZERO else 0
    for m in _messages(file, fd=True):
        channel = str(m.channel + first if isinstance(m.channel, int) else m.channel or "")
        yield Captured(round(m.timestamp * _NS_PER_S), _whole(m), channel)


def _whole(m: can.Message) -> Frame:
    """Return a message with all its data, which of CAN FD are up to 64 bytes."""
    if m.is_fd:
        return Frame(m.arbitration_id, bytes(m.data), m.is_remote_frame, m.is_extended_id)
    return as_frame(m)


def kind_of(file: Path) -> str:
    """Return by which ending python-can knows a log of frames: its content decides, if it can.

    Raises:
        UserError: if it cannot be read.

    """
    try:
        return content(file) or file.suffix.lower()
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror or error}") from None


def _messages(file: Path, *, fd: bool = False) -> Iterator[can.Message]:
    """Yield the classical CAN messages of a log, and those of CAN FD where wanted."""
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
    except Exception as error:  # python-can's readers answer damage with many kinds of exception
        if lines:
            raise lines[0].trouble("cannot be read as a frame") from None
        raise UserError(f"{file}: is not a readable log of frames: {error}") from None


def _reader(file: Path, lines: list[Lines]) -> Generator[can.Message, None, None]:
    """Yield what python-can's reader of a file finds; a text's lines are put into a list."""
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
        binary: Any = _Objects(file)
    else:
        binary = can.SqliteReader(str(file)) if kind == ".db" else can.LogReader(str(file))
    with binary:
        yield from binary


def _as_it_is(line: str) -> str:
    return line


_TEXTS: dict[str, tuple[Any, Callable[[], Callable[[str], str]]]] = {
    ".asc": (can.ASCReader, Cumulated),
    ".log": (can.CanutilsLogReader, lambda: candump_line),
    ".trc": (can.TRCReader, lambda: _as_it_is),
    ".csv": (can.CSVReader, lambda: _as_it_is),
}
"""python-can's readers of texts by their endings, and what makes the lines that they get."""

_FROM_ZERO = (".asc", ".blf")
"""Formats whose channels python-can counts from 0, and Vector's tools from 1."""


class _Objects(can.BLFReader):
    """Reads a BLF file whose containers unpack to bounded sizes and whose objects have a size.

    The base class unpacks a container whole, and never ends at an object without a size.
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
                return  # the base class says what is wrong with it
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
                raise ValueError(f"an object says that it has {size} bytes")
            at = data.find(_OBJECT, at + size, at + size + 8)
        yield from super()._parse_data(data)
