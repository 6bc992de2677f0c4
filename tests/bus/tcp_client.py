"""A client of the TCP server that sends raw bytes, also invalid ones."""

import socket
import struct
import time
from collections.abc import Callable

from wires import PATIENCE_S, frame_of

from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.frame import Frame


def polled(server: SocketcandServerBus, until: Callable[[], bool]) -> list[Frame]:
    """Poll a server until a condition is true; return the frames that it received."""
    frames: list[Frame] = []
    deadline = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < deadline, "it never became true"
        message = server.recv(0.001)
        if message is not None:
            frames.append(frame_of(message))
    return frames


class Client:
    """A TCP connection to the server that sends only explicit data."""

    def __init__(self, server: SocketcandServerBus, receive_buffer: int | None = None) -> None:
        self._server = server
        self._heard = b""
        self.socket = socket.socket()
        if receive_buffer is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect((server.host, server.port))

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, text: bytes) -> None:
        """Send bytes."""
        self.socket.sendall(text)

    def heard(self) -> bytes:
        """Return all bytes received since the last `hear`, without waiting."""
        try:
            while chunk := self.socket.recv(1 << 16, socket.MSG_DONTWAIT):
                self._heard += chunk
        except BlockingIOError:
            pass
        return self._heard

    def hear(self, commands: int) -> bytes:
        """Poll the server until this many commands have been received; return and drop them."""
        polled(self._server, lambda: self.heard().count(b">") >= commands)
        text, self._heard = self._heard, b""
        return text

    def shake_hands(self) -> "Client":
        """Reach raw mode."""
        assert self.hear(1) == b"< hi >"
        self.send(b"< open can0 >")
        assert self.hear(1) == b"< ok >"
        self.send(b"< rawmode >")
        assert self.hear(1) == b"< ok >"
        return self

    def reset(self) -> None:
        """Close the connection with a reset, as a killed process does."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.close()
