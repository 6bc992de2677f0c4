"""One client of the embedded TCP server: its socket, its handshake, its write buffer."""

import contextlib
import socket
import time

from hil_emulator.bus import socketcand
from hil_emulator.frame import Frame

READ_BYTES = 2048  # taken from one client in one poll, about 50 frames; assumed
WRITE_BUFFER_BYTES = 256 * 1024  # about 6500 frames, 0.7 s of a full 1 Mbit/s bus; assumed
HANDSHAKE_PAUSE_S = 0.05  # python-can's client needs microseconds to read the last "ok"; assumed

HANDSHAKE_LIMIT_S = 5.0  # a slower client may be closed for another; assumed

_QUICKACK: int | None = getattr(socket, "TCP_QUICKACK", None)  # Linux only


class Connection:
    """A client of the bus, from `< hi >` until it vanishes.

    A client that begins with anything but `< open` is refused at once: a web page can make a
    browser post to this port, and commands in the body of its request would be executed.

    Frames for a client are held back for `HANDSHAKE_PAUSE_S` after the last `< ok >`, or until the
    client sends: python-can's client compares one whole `recv()` with `< ok >`, and a frame in the
    same segment would fail its handshake.

    A client that stops reading loses frames, newest first, and stays connected, as a slow CAN
    controller overruns its receive buffer but stays on the bus. Closing the connection would not
    help: python-can's client does not notice it.

    Attributes:
        raw: whether the handshake is complete and frames go both ways.
        gone: whether the client has vanished or is refused; the owner then calls `close()`.
        refusal: reason of a refusal, else "".
        dropped: number of frames lost because the client did not read.
        ignored: number of invalid commands.

    """

    def __init__(self, sock: socket.socket, channel: str) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        self.socket = sock
        self.raw = False
        self.gone = False
        self.refusal = ""
        self.dropped = 0
        self.ignored = 0
        self._since = time.monotonic()
        self._channel = channel
        self._beginning: bytes | None = b""  # first bytes received; None once they are checked
        self._opened = False
        self._silent_until: float | None = None  # [s] of time.monotonic()
        self._commands = socketcand.CommandStream()
        self._waiting = bytearray()
        self._owes_acknowledgement = False
        self._reply(socketcand.HI)

    @property
    def lingers(self) -> bool:
        """Whether the client has exceeded `HANDSHAKE_LIMIT_S` without joining the bus."""
        return not self.raw and time.monotonic() - self._since > HANDSHAKE_LIMIT_S

    @property
    def wants_to_write(self) -> bool:
        """Whether the write buffer is not empty."""
        return bool(self._waiting) and self._silent_until is None

    @property
    def silent_until(self) -> float | None:
        """End of the pause after the handshake [s of time.monotonic()], None when over."""
        return self._silent_until

    def read(self) -> list[Frame]:
        """Read at most `READ_BYTES`, and return the frames in them."""
        try:
            chunk = self.socket.recv(READ_BYTES)
            self._owes_acknowledgement = True
        except BlockingIOError:
            return []
        except OSError:
            chunk = b""
        if not chunk:
            self.gone = True
            return []
        if self.raw and self._silent_until is None:
            plain = self._commands.sends(chunk)
            if plain is not None:
                return plain
        if self._beginning is not None and not self._begins_well(chunk):
            self.refuse(f"no socketcand client: begin with open {self._channel}, then rawmode")
            return []
        frames = [self._obey(command) for command in self._commands.feed(chunk)]
        return [frame for frame in frames if frame is not None]

    def acknowledge(self) -> None:
        """Acknowledge received bytes at once, unless a written segment has done so.

        A delayed acknowledgement holds up the next small segment of a client with Nagle's
        algorithm by 40 ms. The kernel clears the option by itself.
        """
        if self._owes_acknowledgement and _QUICKACK is not None and not self.gone:
            with contextlib.suppress(OSError):  # `read` detects a vanished client
                self.socket.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
        self._owes_acknowledgement = False

    def write(self, lines: bytes, count: int) -> bool:
        """Send `count` whole lines now or later; return False if they were dropped."""
        if len(self._waiting) + len(lines) > WRITE_BUFFER_BYTES:
            self.dropped += count
            return False
        if not self._waiting and self._silent_until is None:
            self._waiting += lines[self._taken(lines) :]
            return True
        self._waiting += lines
        if self._silent_until is None:
            self.flush()
        return True

    def flush(self) -> None:
        """Write as much of the buffer as the socket accepts."""
        del self._waiting[: self._taken(self._waiting)]

    def _taken(self, lines: bytes | bytearray) -> int:
        """Write to the socket; return the number of bytes that it accepted."""
        try:
            count = self.socket.send(lines)
        except BlockingIOError:
            return 0
        except OSError:
            self.gone = True
            return 0
        self._owes_acknowledgement = False
        return count

    def speak_up(self) -> None:
        """End the pause after the handshake and write the frames held back."""
        self._silent_until = None
        if self._waiting:
            self.flush()

    def refuse(self, reason: str) -> None:
        """Mark the client as refused; the owner sends it `reason` and closes the socket."""
        self.refusal = reason
        self.gone = True

    def close(self) -> None:
        """Close the socket; the write buffer is discarded."""
        self.gone = True
        self._waiting.clear()
        self.socket.close()

    def _obey(self, command: bytes) -> Frame | None:
        if not self.raw:
            self._shake_hands(command)
            return None
        if self._silent_until is not None:
            self.speak_up()
        frame = socketcand.parse_send(command)
        if frame is None:
            self.ignored += 1
        return frame

    def _begins_well(self, chunk: bytes) -> bool:
        """Return whether the bytes received so far can begin with `< open`."""
        assert self._beginning is not None
        self._beginning = (self._beginning + chunk)[: socketcand.MAX_COMMAND]
        verdict = socketcand.opens(self._beginning)
        if verdict:
            self._beginning = None
        return verdict is not False

    def _shake_hands(self, command: bytes) -> None:
        words = command.decode("ascii", "replace").split()
        if words == ["open", self._channel]:
            self._opened = True
            self._reply(socketcand.OK)
        elif words == ["rawmode"] and self._opened:
            self.raw = True
            self._silent_until = time.monotonic() + HANDSHAKE_PAUSE_S
            self._reply(socketcand.OK)
        elif words == ["echo"]:
            self._reply(socketcand.ECHO)
        else:
            self.ignored += 1
            self._reply(socketcand.format_error(f"only open {self._channel}, then rawmode"))

    def _reply(self, line: bytes) -> None:
        # Each reply is a segment; a reply that does not fit means that the peer never reads.
        try:
            self.gone |= self.socket.send(line) < len(line)
        except OSError:
            self.gone = True
