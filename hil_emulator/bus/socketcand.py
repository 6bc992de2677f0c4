"""The socketcand text protocol in raw mode, without any input or output.

A conversation is a stream of commands between `<` and `>`:

    server  < hi >                          on connection
    client  < open can0 >                   server  < ok >
    client  < rawmode >                     server  < ok >
    client  < send 123 4 1a 22 3 44 >       identifier, length, bytes; hexadecimal, unpadded
    server  < frame 123 23.424242 1A220344 >    identifier, time [s], bytes
    server  < error 040 23.424242 >             class of an error frame, time [s]

An identifier of eight digits is a 29-bit one. The protocol has no remote frames and no CAN FD;
python-can's client writes a remote frame as one without data, and a length above 0 gives it away.

Source: socketcand's protocol description (`doc/protocol.md` of linux-can/socketcand).
"""

import re

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
_MAX_STANDARD_ID = 0x7FF  # CAN identifiers have 11 or 29 bits (ISO 11898-1)
_MAX_EXTENDED_ID = 0x1FFF_FFFF


class CommandStream:
    """Cuts a byte stream into commands, however the network has segmented it.

    What stands outside `<` and `>` is skipped, a `<` always starts anew, and an unfinished
    command longer than `MAX_COMMAND` is forgotten: garbage costs neither memory nor the
    commands after it.
    """

    def __init__(self) -> None:
        self._unfinished = b""

    def feed(self, chunk: bytes) -> list[bytes]:
        """Return the commands completed by `chunk`, in order, without their brackets."""
        stream = self._unfinished + chunk
        end = stream.rfind(b">") + 1
        start = stream.rfind(b"<", end)
        unfinished = stream[start:] if start >= 0 else b""
        self._unfinished = unfinished if len(unfinished) <= MAX_COMMAND + 1 else b""
        return _COMMAND.findall(stream, 0, end)


def opens(beginning: bytes) -> bool | None:
    """Tell whether a stream begins with `< open`; None while that cannot be known yet."""
    said = b"".join(beginning.split())[: len(_OPEN)]
    if said == _OPEN:
        return True
    return None if _OPEN.startswith(said) and len(beginning) < MAX_COMMAND else False


def parse_send(command: bytes) -> Frame | None:
    """Return the frame of a `send` command; None where it is anything else or ill-formed.

    A length without data is that of a remote frame.
    """
    match = _SEND.fullmatch(command)
    if match is None:
        return None
    id_text, length, data_text = match.groups()
    can_id, extended = int(id_text, 16), len(id_text) == 8
    data = bytes([int(byte, 16) for byte in data_text.split()])
    remote = not data and length != b"0"
    if can_id > (_MAX_EXTENDED_ID if extended else _MAX_STANDARD_ID):
        return None
    if len(data) != int(length) and not remote:
        return None
    return Frame(can_id, data, remote, extended)


def format_frame(frame: Frame, time: float) -> bytes:
    """Return the line that tells a client about a data frame seen at `time` [s].

    An empty frame keeps both spaces around its missing data: python-can's client needs them.
    """
    width = 8 if frame.extended else 3
    return b"< frame %0*X %.6f %b >" % (width, frame.can_id, time, frame.data.hex().encode())


def format_error_frame(error_class: int, time: float) -> bytes:
    """Return the line that tells a client about an error frame seen at `time` [s].

    Source: socketcand's raw mode (`state_raw.c`); the class is that of Linux's `can/error.h`.
    """
    return b"< error %03X %.6f >" % (error_class, time)


def format_error(reason: str) -> bytes:
    """Return the line that refuses a command during the handshake."""
    return f"< error {reason} >".encode("ascii", "replace")
