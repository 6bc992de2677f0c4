"""Frames in the log files of other tools, by python-can's own readers and writers."""

import struct
import zlib
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path
from typing import Any

import can

from hil_emulator import input_files
from hil_emulator.bus.in_process import as_frame, as_message
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

_NS_PER_S = 1e9
_LATEST_S = 4e9  # of a time in a log [s]: since 1970, until 2096 (assumed)
_CHANNEL = "can0"
_MARKED = (".blf", ".asc")
"""Formats that can hold a remark."""


def write(file: Path, frames: Iterable[tuple[int, bool, Frame]], remarks: Iterable[str]) -> None:
    """Write frames on the emulator's time base.

    Args:
        file: where to; its ending, one of `log_endings.SUFFIXES`, decides the format.
        frames: time [ns], whether the emulator sent it, frame; oldest first.
        remarks: what made the data; written at time 0, where the format can hold it.

    """
    with can.Logger(str(file)) as logger:
        writer: Any = logger
        if file.suffix in _MARKED:
            for remark in remarks:
                writer.log_event(remark, 0.0)
        for now_ns, sent, frame in frames:
            logger(
                as_message(
                    frame,
                    timestamp=now_ns / _NS_PER_S,
                    channel=_CHANNEL if file.suffix == ".log" else 0,
                    is_rx=not sent,
                )
            )


def read(file: Path, tick_ns: int) -> Iterator[tuple[int, bool, Frame]]:
    """Yield the frames of a log, with times rounded to ticks.

    Raises:
        UserError: if it cannot be read.

    """
    for message in _messages(file):
        now_ns = round(message.timestamp * _NS_PER_S / tick_ns) * tick_ns
        yield now_ns, not message.is_rx, as_frame(message)


def captured(file: Path) -> Iterator[tuple[int, Frame]]:
    """Yield time [ns] and frame of a capture.

    Raises:
        UserError: if it cannot be read, or an identifier comes from several channels.

    """
    channels: dict[tuple[int, bool], Any] = {}
    for message in _messages(file):
        key = message.arbitration_id, message.is_extended_id
        if channels.setdefault(key, message.channel) != message.channel:
            raise UserError(
                f"{file}: identifier {key[0]:03X} comes from channel {channels[key]} and from "
                f"channel {message.channel}; keep the frames of one of them"
            )
        yield round(message.timestamp * _NS_PER_S), as_frame(message)


def _messages(file: Path) -> Iterator[can.Message]:
    """Yield the classical CAN messages of a log."""
    try:
        input_files.check(file, input_files.CAPTURE)
        with _reader(file) as reader:
            for number, message in enumerate(reader):
                if number >= MOST_FRAMES:
                    raise UserError(f"{file}: has more than {MOST_FRAMES} frames; cut it")
                if not abs(message.timestamp) <= _LATEST_S:
                    raise ValueError(f"a frame has the time {message.timestamp:g} s")
                if not message.is_error_frame and not message.is_fd:
                    yield message
    except UserError:
        raise
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror or error}") from None
    except Exception as error:  # python-can's readers answer damage with many kinds of exception
        raise UserError(f"{file}: is not a readable log of frames: {error}") from None


def _reader(file: Path) -> can.io.generic.MessageReader:
    return _Objects(file) if file.suffix.lower() == ".blf" else can.LogReader(str(file))


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
