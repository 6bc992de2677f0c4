"""The listening socket of a TCP bus, and refusal of clients."""

import contextlib
import functools
import select
import socket
import sys
from collections.abc import Callable

import can

from hil_emulator.bus import socketcand

_UNREAD_BYTES = 1 << 16  # of a client that is refused (assumed)

MAX_CLIENTS = 16
"""Largest number of clients at a time (assumed)."""


def listen(host: str, port: int) -> socket.socket:
    """Return a listening, non-blocking socket.

    Raises:
        can.CanInitializationError: if address and port cannot be listened on.

    """
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # where it means: share the port with a stranger
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(MAX_CLIENTS)
        listener.setblocking(False)
    except (OSError, OverflowError, TypeError) as error:
        listener.close()
        raise can.CanInitializationError(f"cannot listen on {host}:{port}: {error}") from error
    return listener


def readable(sock: socket.socket) -> Callable[[], object]:
    """Return a function that returns a true value if the socket is readable.

    A selector takes many times as long for a single socket.
    """
    if sys.platform == "win32":
        return lambda: select.select([sock], [], [], 0)[0]
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    return functools.partial(poll.poll, 0)


def refuse(sock: socket.socket, reason: str) -> None:
    """Send a client the reason of its refusal, and close its connection."""
    with sock, contextlib.suppress(OSError):  # the client may be gone already
        sock.setblocking(False)
        sock.send(socketcand.format_error(reason))
        sock.shutdown(socket.SHUT_WR)
        sock.recv(_UNREAD_BYTES)  # closing with unread bytes would reset the connection
