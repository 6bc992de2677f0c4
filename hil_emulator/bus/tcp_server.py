"""A CAN bus over TCP for machines whose kernel has no CAN: python-can's `socketcand_server`.

The bus is the server and has no thread: polling it for frames also serves its clients. A client's
data frame reaches the owner of the bus and all other clients, as on a wire. Remote frames reach
the owner only: see `SocketcandServerBus`.
Stock clients connect with `can.Bus(interface="socketcand", host=..., port=..., channel=...)`.
"""

import logging
import time
from collections import deque
from collections.abc import Collection

import can
from can.typechecking import CanFilters

from hil_emulator.bus import socketcand
from hil_emulator.bus.tcp_clients import Clients
from hil_emulator.bus.tcp_connection import Connection
from hil_emulator.frame import EXTENDED, Frame

DEFAULT_PORT = 29536  # socketcand's registered TCP port

_log = logging.getLogger(__name__)

SYNC = 0x080
"""Predefined identifier of SYNC, which is empty or carries a counter (CiA 301 7.2.5): a node may
produce it with a counter and later consume it without."""


class SocketcandServerBus(can.BusABC):
    """A python-can bus whose other nodes are TCP clients speaking socketcand.

    Use it from one thread, and poll it with `recv(0)` in a loop: it works only during calls.

    Stock clients write a remote frame as an empty data frame. An identifier has one sender, so an
    empty frame whose identifier the owner uses for data was a remote frame. The owner receives it
    as one; the other clients do not receive it, since the protocol has no remote frames.

    Args:
        channel: channel name that clients have to open.
        host: address to listen on.
        port: TCP port, 0 for any free port.
        can_filters: as for every python-can bus.
        **kwargs: further settings common to python-can's buses.

    Attributes:
        host: address in use.
        port: port in use.
        dropped: number of frames lost by clients that did not read, summed over clients.
        ignored: number of invalid commands of all clients.
        messages: received messages that are not classical frames; always empty here.

    Raises:
        can.CanInitializationError: if address and port cannot be listened on.

    """

    def __init__(
        self,
        channel: str = "can0",
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        can_filters: CanFilters | None = None,
        **kwargs: object,
    ) -> None:
        self._clients = Clients(host, port, channel, self._take)
        self.host, self.port = self._clients.host, self._clients.port
        self.channel = channel
        self.channel_info = f"socketcand server for {channel} on {self.host}:{self.port}"
        self.messages: list[can.Message] = []
        self._inbox: deque[Frame] = deque()
        self._data_ids: set[int] = set()  # identifiers under which the owner has sent data
        self._warned = False
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    @property
    def clients(self) -> int:
        """Number of connected clients, before and after their handshake."""
        return len(self._clients.connected)

    @property
    def dropped(self) -> int:
        """Frames lost to clients that did not read them, each client counting."""
        return self._clients.dropped

    @property
    def ignored(self) -> int:
        """Number of invalid commands of all clients."""
        return self._clients.ignored

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to all clients; never waits, whatever `timeout`.

        Raises:
            can.CanOperationError: for a frame the protocol cannot carry (remote, CAN FD), or where
                a client that does not read has lost it.

        """
        if msg.is_error_frame:
            line = socketcand.format_error_frame(msg.arbitration_id, time.time())
            self._clients.write(line, 1)
            return
        frame = Frame(msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.is_extended_id)
        lost = 0 if msg.is_fd else self.send_frames([frame])
        if msg.is_remote_frame or msg.is_fd:
            raise can.CanOperationError("socketcand carries classical data frames only")
        if lost:
            raise can.CanOperationError("a client that does not read has lost this frame")

    def receive_frames(self, limit: int) -> list[Frame]:
        """Read once from every client; return the arrived frames, at most `limit`."""
        self._clients.serve_all()
        if len(self._inbox) > limit:
            return [self._inbox.popleft() for _ in range(limit)]
        arrived = list(self._inbox)
        self._inbox.clear()
        return arrived

    def send_frames(self, frames: Collection[Frame]) -> int:
        """Send frames to all clients, one write each; return how many frames a client lost."""
        carried = []
        for frame in frames:
            can_id, data, remote, extended = frame
            if remote:
                self._warn(can_id)
                continue
            if data:
                self._data_ids.add(can_id | EXTENDED if extended else can_id)
            carried.append(frame)
        complete = not carried or self._send_to_all(carried)
        return len(frames) - (len(carried) if complete else 0)

    def shutdown(self) -> None:
        """Close the port and all connections; a second call has no effect."""
        super().shutdown()
        self._clients.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._inbox:
            self._clients.serve_ready(timeout)
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

    def _take(self, client: Connection, frames: list[Frame]) -> None:
        """Receive a client's frames, and forward them to the other clients."""
        # only a frame without data can be a remote frame
        meant = [frame if frame.data else self._as_meant(frame) for frame in frames]
        self._inbox.extend(meant)
        if len(self._clients.connected) > 1:
            self._send_to_all([frame for frame in meant if not frame.remote], client)

    def _as_meant(self, frame: Frame) -> Frame:
        """Return a client's frame, as remote frame if the client meant one."""
        if not frame.data and frame.identifier in self._data_ids and frame.can_id != SYNC:
            frame = frame._replace(remote=True)
        if frame.remote:
            self._warn(frame.can_id)
        return frame

    def _warn(self, can_id: int) -> None:
        """Log once that remote frames do not reach the TCP clients."""
        if not self._warned:
            self._warned = True
            _log.warning(
                "remote frame %03X: socketcand cannot carry it to TCP clients; use a bus of the "
                "kernel (interface = 'socketcan') where controllers rely on them", can_id,
            )  # fmt: skip

    def _send_to_all(self, frames: list[Frame], but: Connection | None = None) -> bool:
        """Send frames to all clients except `but`; return False if a client lost them."""
        return self._clients.write(socketcand.format_frames(frames, time.time()), len(frames), but)
