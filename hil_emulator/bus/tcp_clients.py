"""Connections of a TCP bus: accepting, handshake, reading, writing and closing."""

import contextlib
import logging
import selectors
import socket
import time
from collections.abc import Callable
from typing import cast

from hil_emulator.bus.tcp_connection import HANDSHAKE_LIMIT_S, Connection
from hil_emulator.bus.tcp_listener import MAX_CLIENTS, listen, readable, refuse
from hil_emulator.frame import Frame

_log = logging.getLogger(__name__)

LOOK_AROUND_S = 0.005
"""Time between checks for new connections [s] (assumed)."""

Take = Callable[[Connection, list[Frame]], None]
"""Takes the frames that a client has sent."""


class Clients:
    """The connections of a TCP bus, served in the calls of its owner.

    Args:
        host: address to listen on.
        port: TCP port, 0 for any free port.
        channel: channel name that clients have to open.
        take: receives the frames that a client has sent.

    Attributes:
        connected: present connections, before and after their handshake.
        host: address in use.
        port: port in use.

    Raises:
        can.CanInitializationError: if address and port cannot be listened on.

    """

    def __init__(self, host: str, port: int, channel: str, take: Take) -> None:
        self._listener = listen(host, port)
        self.host: str
        self.port: int
        self.host, self.port = self._listener.getsockname()[:2]
        self.connected: tuple[Connection, ...] = ()
        self._channel, self._take = channel, take
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._knocks = readable(self._listener)
        self._refusals: set[str] = set()
        self._silent: list[Connection] = []  # clients in the pause after their handshake
        self._look_around = 0.0  # [s] of time.monotonic()
        self._lost = 0
        self._senseless = 0

    @property
    def dropped(self) -> int:
        """Frames lost to clients that did not read them, each client counting."""
        return self._lost + sum(client.dropped for client in self.connected)

    @property
    def ignored(self) -> int:
        """Number of invalid commands of all clients."""
        return self._senseless + sum(client.ignored for client in self.connected)

    def serve_all(self) -> None:
        """Read once from every client, without a query which clients have sent something.

        New clients and clients in their handshake are served every few milliseconds: a query of
        the ready sockets takes longer than reading from one.
        """
        now = time.monotonic()
        if now >= self._look_around:
            self._look_around = now + LOOK_AROUND_S
            if self._silent:
                self._end_pauses(None)
            if self._knocks():
                self._accept()
        for client in self.connected:
            client.acknowledge()
            if client.wants_to_write:
                client.flush()
            self._read(client)
            if client.gone or client.wants_to_write:
                self._watch(client)

    def serve_ready(self, timeout: float | None) -> None:
        """Serve every socket that is ready, once; wait up to `timeout` [s] for the first."""
        for connection in self.connected:
            connection.acknowledge()
        if self._silent:
            timeout = self._end_pauses(timeout)
        for key, events in self._selector.select(timeout):
            client = cast("Connection | None", key.data)
            if client is None:
                self._accept()
                continue
            if events & selectors.EVENT_WRITE:
                client.flush()
            if events & selectors.EVENT_READ and not client.gone:
                self._read(client)
            self._watch(client)

    def write(self, lines: bytes, count: int, but: Connection | None = None) -> bool:
        """Write `count` lines to clients in raw mode except `but`; return whether all have them."""
        complete = True
        for client in self.connected:
            if client.raw and not client.gone and client is not but:
                complete &= client.write(lines, count)
                if client.gone or client.wants_to_write:
                    self._watch(client)
        return complete

    def close(self) -> None:
        """Close the port and all connections; a second call has no effect."""
        for client in self.connected:
            client.close()
        self.connected = ()
        self._listener.close()
        self._selector.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # a client that is gone already needs no service
            sock, _ = self._listener.accept()
            if len(self.connected) >= MAX_CLIENTS:
                self._dismiss()
            if len(self.connected) >= MAX_CLIENTS:
                self._refuse(sock, f"{MAX_CLIENTS} clients are connected already: close one")
                return
            client = Connection(sock, self._channel)
            self._selector.register(sock, selectors.EVENT_READ, client)
            self.connected += (client,)
            self._watch(client)

    def _dismiss(self) -> None:
        """Close connections that exceed `HANDSHAKE_LIMIT_S` without joining the bus."""
        for client in [c for c in self.connected if c.lingers]:
            client.refuse(f"no rawmode for {HANDSHAKE_LIMIT_S:g} s: connect again")
            self._watch(client)

    def _refuse(self, sock: socket.socket, reason: str) -> None:
        """Refuse a client, and log the reason, each reason once."""
        if reason not in self._refusals:
            self._refusals.add(reason)
            _log.warning("CAN port %d: a client is refused: %s", self.port, reason)
        refuse(sock, reason)

    def _read(self, client: Connection) -> None:
        was_raw = client.raw
        frames = client.read()
        if client.raw and not was_raw:
            self._silent.append(client)
        if frames:
            self._take(client, frames)

    def _watch(self, client: Connection) -> None:
        """Remove a client that has vanished; register the other clients' events."""
        if client not in self.connected:
            return
        if client.gone:
            self.connected = tuple(other for other in self.connected if other is not client)
            self._lost += client.dropped
            self._senseless += client.ignored
            self._selector.unregister(client.socket)
            if client.refusal:
                self._refuse(client.socket, client.refusal)
            client.close()
            return
        events = selectors.EVENT_READ
        if client.wants_to_write:
            events |= selectors.EVENT_WRITE
        if self._selector.get_key(client.socket).events != events:
            self._selector.modify(client.socket, events, client)

    def _end_pauses(self, timeout: float | None) -> float | None:
        """End the pauses that are over; return the time until the next pause ends [s]."""
        now = time.monotonic()
        for client in self._silent:
            until = client.silent_until
            if until is not None and until <= now and not client.gone:
                client.speak_up()
                self._watch(client)
        self._silent = [c for c in self._silent if c.silent_until is not None and not c.gone]
        ends = [until - now for c in self._silent if (until := c.silent_until) is not None]
        return min(ends + ([] if timeout is None else [timeout]), default=timeout)
