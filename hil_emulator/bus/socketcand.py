"""The socketcand text protocol in raw mode: parser and formatter, without sockets.

A conversation is a stream of commands between `<` and `>`:

    server  < hi >                          on connection
    client  < open can0 >                   server  < ok >
    client  < rawmode >                     server  < ok >
    client  < send 123 4 1a 22 3 44 >       identifier, length, bytes; hexadecimal, unpadded
    server  < frame 123 23.424242 1A220344 >    identifier, time [s], bytes
    server  < error 040 23.424242 >             class of an error frame, time [s]

An identifier of eight digits has 29 bits. The protocol has no remote frames and no CAN FD.
python-can's client writes a remote frame as a frame without data; a length above 0 reveals it.

Source: socketcand's protocol description (`doc/protocol.md` of linux-can/socketcand).
"""

import re
from binascii import hexlify
from collections.abc import Iterable

from hil_emulator.frame import Frame

MAX_COMMAND = 128  # bytes between "<" and ">"; the longest send command is 42. Assumed.

HI = b"< hi >"
OK = b"< ok >"
ECHO = b"< echo >"

_OPEN = b"<open"
_COMMAND = re.compile(rb"<([^<>]{0,%d})>" % MAX_COMMAND)
_SEND = re.compile(
    rb"\s*send\s+([0-9A-Fa-f]{1,3}|[0-9A-Fa-f]{8})\s+([0-8])((?:\s+[0-9A-Fa-f]{1,2}){0,8})\s*"
)
_PLAIN_SENDS = re.compile(
    rb"< send ([0-9A-Fa-f]{1,3}|[0-9A-Fa-f]{8}) ([0-8])((?: [0-9A-Fa-f]{1,2}){0,8}) {1,2}>"
)
_DIGITS = "0123456789abcdefABCDEF"
_BYTES = {(a + b).encode(): int(a + b, 16) for a in ("", *_DIGITS) for b in _DIGITS}
"""Value of a byte by each of its spellings."""

_STANDARD_FRAME, _EXTENDED_FRAME = b"< frame %03X %b %b >", b"< frame %08X %b %b >"
_MAX_STANDARD_ID = 0x7FF  # CAN identifiers have 11 or 29 bits (ISO 11898-1)
_MAX_EXTENDED_ID = 0x1FFF_FFFF


class CommandStream:
    """Splits a byte stream into commands, independent of TCP segments.

    Text outside `<` and `>` is skipped, a `<` begins a new command, and an unfinished command
    longer than `MAX_COMMAND` is discarded. Invalid input thus takes no memory, and later commands
    are read.
    """

    def __init__(self) -> None:
        self._unfinished = b""

    def sends(self, chunk: bytes) -> list[Frame] | None:
        """Return the frames of a chunk that consists of whole `send` commands, else None.

        If None, pass the chunk to `feed`.
        """
        parts_of_sends = _PLAIN_SENDS.findall(chunk)
        # each has one "<" and one ">": where there are no others, nothing is left over
        if self._unfinished or not len(parts_of_sends) == chunk.count(b"<") == chunk.count(b">"):
            return None
        frames = [frame for parts in parts_of_sends if (frame := _frame(*parts)) is not None]
        return frames if len(frames) == len(parts_of_sends) else None

    def feed(self, chunk: bytes) -> list[bytes]:
        """Return the commands completed by `chunk`, in order, without their brackets."""
        stream = self._unfinished + chunk if self._unfinished else chunk
        end = stream.rfind(b">") + 1
        start = stream.rfind(b"<", end)
        unfinished = stream[start:] if start >= 0 else b""
        self._unfinished = unfinished if len(unfinished) <= MAX_COMMAND + 1 else b""
        return _COMMAND.findall(stream, 0, end)


def opens(beginning: bytes) -> bool | None:
    """Return whether a stream begins with `< open`; None if it is too short to decide."""
    begun = b"".join(beginning.split())[: len(_OPEN)]
    if begun == _OPEN:
        return True
    return None if _OPEN.startswith(begun) and len(beginning) < MAX_COMMAND else False


def parse_send(command: bytes) -> Frame | None:
    """Return the frame of a `send` command; None for another or an invalid command.

    A length above 0 without data is a remote frame.
    """
    match = _SEND.fullmatch(command)
    if match is None:
        return None
    return _frame(*match.groups())


def _frame(id_text: bytes, length: bytes, data_text: bytes) -> Frame | None:
    """Return the frame of a command's parts; None if they contradict each other."""
    can_id, extended = int(id_text, 16), len(id_text) == 8
    data = bytes([_BYTES[digits] for digits in data_text.split()])
    remote = not data and length != b"0"
    if can_id > (_MAX_EXTENDED_ID if extended else _MAX_STANDARD_ID):
        return None
    if len(data) != int(length) and not remote:
        return None
    return Frame(can_id, data, remote, extended)


def format_frames(frames: Iterable[Frame], time: float) -> bytes:
    """Return the lines that report data frames at `time` [s] to a client.

    An empty frame keeps both spaces around its missing data: python-can's client needs them.
    """
    stamp = b"%.6f" % time
    return b"".join(
        [
            (_EXTENDED_FRAME if extended else _STANDARD_FRAME) % (can_id, stamp, hexlify(data))
            for can_id, data, _, extended in frames
        ]
    )


def format_error_frame(error_class: int, time: float) -> bytes:
    """Return the line that reports an error frame at `time` [s] to a client.

    Source: socketcand's raw mode (`state_raw.c`); the class is that of Linux's `can/error.h`.
    """
    return b"< error %03X %.6f >" % (error_class, time)


def format_error(reason: str) -> bytes:
    """Return the line that refuses a command during the handshake."""
    return f"< error {reason} >".encode("ascii", "replace")
