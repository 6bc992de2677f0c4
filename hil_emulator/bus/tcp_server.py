"""A CAN bus over TCP for machines whose kernel has none: python-can's `socketcand_server`.

The bus *is* the server: whoever polls it for frames also serves its clients. There is no thread.
Every data frame a client sends reaches the owner of the bus and all other clients, as on a wire.
Remote frames reach the owner only: see `SocketcandServerBus`.
Stock clients connect with `can.Bus(interface="socketcand", host=..., port=..., channel=...)`.
"""

import contextlib
import logging
import selectors
import time
from collections import deque
from collections.abc import Collection, Iterable
from typing import cast

import can
from can.typechecking import CanFilters

from hil_emulator.bus import socketcand
from hil_emulator.bus.tcp_connection import Connection
from hil_emulator.bus.tcp_listener import MAX_CLIENTS, listen, readable, turn_away
from hil_emulator.frame import EXTENDED, Frame

DEFAULT_PORT = 29536  # socketcand's registered TCP port
LOOK_AROUND_S = 0.005  # between looks for who comes; assumed

_log = logging.getLogger(__name__)

SYNC = 0x080
"""Predefined identifier of SYNC, which is empty or carries a counter (CiA 301 7.2.5): who produced
it with one may consume it without one later."""


class SocketcandServerBus(can.BusABC):
    """A python-can bus whose other nodes are TCP clients speaking socketcand.

    To be used from one thread. Nothing moves between calls: poll it with `recv(0)` in a loop.

    Stock clients write a remote frame as an empty data frame. As an identifier has one sender,
    an empty frame under one that the owner itself sends data with was a remote frame: the owner
    is told so, and the other clients, to whom the protocol cannot tell it, hear nothing.

    Args:
        channel: the name clients have to open.
        host: address to listen on; nothing listens beyond it.
        port: TCP port, 0 for any free one.
        can_filters: as for every python-can bus.
        **kwargs: further settings common to python-can's buses.

    Attributes:
        host: the address in use.
        port: the port in use.
        dropped: frames lost to clients that did not read them, each client counting.
        ignored: commands of clients that made no sense.
        messages: what arrived and is no classical frame: nothing here.

    Raises:
        can.CanInitializationError: where address and port cannot be listened on.

    """

    def __init__(
        self,
        channel: str = "can0",
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        can_filters: CanFilters | None = None,
        **kwargs: object,
    ) -> None:
        self._listener = listen(host, port)
        self.host: str
        self.port: int
        self.host, self.port = self._listener.getsockname()[:2]
        self.channel = channel
        self.channel_info = f"socketcand server for {channel} on {self.host}:{self.port}"
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._knocks = readable(self._listener)
        self._clients: tuple[Connection, ...] = ()
        self._silent: list[Connection] = []  # those in the pause after their handshake
        self.messages: list[can.Message] = []
        self._inbox: deque[Frame] = deque()
        self._own: set[int] = set()  # identifiers under which the owner has sent data
        self._look_around = 0.0  # [s] of time.monotonic()
        self._warned = False
        self._lost = 0
        self._senseless = 0
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    @property
    def clients(self) -> int:
        """Clients connected at present, whether they have finished their handshake or not."""
        return len(self._clients)

    @property
    def dropped(self) -> int:
        """Frames lost to clients that did not read them, each client counting."""
        return self._lost + sum(client.dropped for client in self._clients)

    @property
    def ignored(self) -> int:
        """Commands of clients that made no sense."""
        return self._senseless + sum(client.ignored for client in self._clients)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to all clients; never waits, whatever `timeout`.

        Raises:
            can.CanOperationError: for a frame the protocol cannot carry (remote, CAN FD), or where
                a client that does not read has lost it.

        """
        if msg.is_error_frame:
            line = socketcand.format_error_frame(msg.arbitration_id, time.time())
            self._write(line, 1, self._clients)
            return
        frame = Frame(msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.is_extended_id)
        lost = 0 if msg.is_fd else self.send_frames([frame])
        if msg.is_remote_frame or msg.is_fd:
            raise can.CanOperationError("socketcand carries classical data frames only")
        if lost:
            raise can.CanOperationError("a client that does not read has lost this frame")

    def receive_frames(self, limit: int) -> list[Frame]:
        """Read what every client has said, once; return what has arrived, at most `limit`.

        Who comes, or is in the midst of joining, is looked after every few milliseconds: asking
        the system which sockets are ready takes longer than reading from one.
        """
        now = time.monotonic()
        if now >= self._look_around:
            self._look_around = now + LOOK_AROUND_S
            self._look_who_comes()
        for client in self._clients:
            client.acknowledge()
            if client.wants_to_write:
                client.flush()
            self._read(client)
            if client.gone or client.wants_to_write:
                self._watch(client)
        if len(self._inbox) > limit:
            return [self._inbox.popleft() for _ in range(limit)]
        arrived = list(self._inbox)
        self._inbox.clear()
        return arrived

    def _look_who_comes(self) -> None:
        """Let clients in, and those speak whose pause after the handshake is over."""
        if self._silent:
            self._end_pauses(None)
        if self._knocks():
            self._accept()

    def send_frames(self, frames: Collection[Frame]) -> int:
        """Send frames to all clients in one write for each; return how many some did not get."""
        carried = []
        for frame in frames:
            can_id, data, remote, extended = frame
            if remote:
                self._warn(can_id)
                continue
            if data:
                self._own.add(can_id | EXTENDED if extended else can_id)
            carried.append(frame)
        told = not carried or self._tell(carried, self._clients)
        return len(frames) - (len(carried) if told else 0)

    def shutdown(self) -> None:
        """Close the port and all connections; harmless when repeated."""
        super().shutdown()
        for client in self._clients:
            client.close()
        self._clients = ()
        self._listener.close()
        self._selector.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._inbox:
            self._poll(timeout)
            if not self._inbox:
                return None, False
        frame = self._inbox.popleft()
        message = can.Message(
            timestamp=time.time(),
            arbitration_id=frame.can_id,
            is_extended_id=frame.extended,
            is_remote_frame=frame.remote,
            channel=self.channel,
            data=frame.data,
        )
        return message, False

    def _poll(self, timeout: float | None) -> None:
        """Serve every socket that is ready, once; wait up to `timeout` [s] for the first."""
        for known in self._clients:
            known.acknowledge()
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

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # who has gone again already need not be served
            sock, _ = self._listener.accept()
            if len(self._clients) >= MAX_CLIENTS:
                self._dismiss()
            if len(self._clients) >= MAX_CLIENTS:
                turn_away(sock)
                return
            client = Connection(sock, self.channel)
            self._selector.register(sock, selectors.EVENT_READ, client)
            self._clients += (client,)
            self._watch(client)

    def _dismiss(self) -> None:
        """Let those go who hold a place without ever joining the bus."""
        for client in [c for c in self._clients if c.lingers]:
            client.gone = True
            self._watch(client)

    def _read(self, client: Connection) -> None:
        was_raw = client.raw
        # only one without data can have been another frame, or be one that is warned of
        frames = [frame if frame.data else self._as_meant(frame) for frame in client.read()]
        if client.raw and not was_raw:
            self._silent.append(client)
        if frames:
            self._inbox.extend(frames)
            others = [other for other in self._clients if other is not client]
            if others:
                self._tell([frame for frame in frames if not frame.remote], others)

    def _as_meant(self, frame: Frame) -> Frame:
        """Return a client's frame, or the remote frame that it was before it became text."""
        if not frame.data and frame.identifier in self._own and frame.can_id != SYNC:
            frame = frame._replace(remote=True)
        if frame.remote:
            self._warn(frame.can_id)
        return frame

    def _warn(self, can_id: int) -> None:
        """Say once that remote frames do not get through."""
        if not self._warned:
            self._warned = True
            _log.warning(
                "remote frame %03X: socketcand carries none to the TCP clients; use a bus of the "
                "kernel (interface = 'socketcan') where controllers rely on them", can_id,
            )  # fmt: skip

    def _tell(self, frames: list[Frame], clients: Iterable[Connection]) -> bool:
        """Send `frames` to those of `clients` that are in raw mode; False where one lost them."""
        now = time.time()
        return self._write(socketcand.format_frames(frames, now), len(frames), clients)

    def _write(self, lines: bytes, count: int, clients: Iterable[Connection]) -> bool:
        """Write `count` lines to those of `clients` that are in raw mode; False where one lost."""
        complete = True
        for client in clients:
            if client.raw and not client.gone:
                complete &= client.write(lines, count)
                if client.gone or client.wants_to_write:
                    self._watch(client)
        return complete

    def _watch(self, client: Connection) -> None:
        """Forget a client that has vanished; watch the others for what they are waiting for."""
        if client not in self._clients:
            return
        if client.gone:
            self._clients = tuple(other for other in self._clients if other is not client)
            self._lost += client.dropped
            self._senseless += client.ignored
            self._selector.unregister(client.socket)
            client.close()
            return
        events = selectors.EVENT_READ
        if client.wants_to_write:
            events |= selectors.EVENT_WRITE
        if self._selector.get_key(client.socket).events != events:
            self._selector.modify(client.socket, events, client)

    def _end_pauses(self, timeout: float | None) -> float | None:
        """Let clients speak whose pause is over; return the time [s] until the next one's end."""
        now = time.monotonic()
        for client in self._silent:
            until = client.silent_until
            if until is not None and until <= now and not client.gone:
                client.speak_up()
                self._watch(client)
        self._silent = [c for c in self._silent if c.silent_until is not None and not c.gone]
        ends = [until - now for c in self._silent if (until := c.silent_until) is not None]
        return min(ends + ([] if timeout is None else [timeout]), default=timeout)
