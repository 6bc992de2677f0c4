"""`Bus`: receives and sends frames without blocking the loop."""

import itertools
import time
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any

import can

from hil_emulator.bus.in_process import InProcessBus, as_frame, as_message
from hil_emulator.bus.opening import client_command, open_can_bus
from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.frame import Burst, Frame

# Frames of one receive(): 128 per millisecond are more than ten times the capacity of a CAN bus of
# 1 Mbit/s, so only a flood from memory or TCP reaches the limit. Assumed.
RECEIVE_LIMIT = 128

_CLASSICAL_BYTES = 8  # ISO 11898-1
_AS_THEY_ARE = (Burst, list)


class Bus(AbstractContextManager["Bus"]):
    """The rig's CAN port on any interface of python-can.

    Args:
        settings: the `[bus]` table of the configuration: python-can's `interface` and the
            settings of that interface.

    Attributes:
        received: number of frames received.
        sent: number of frames that the interface accepted.
        dropped: number of frames that the interface refused: a full queue, a vanished interface,
            a client that does not read, a kind of frame that it cannot carry.
        error_frames: number of error frames, and of CAN FD frames, which are errors to a classical
            controller.
        read_errors: number of failed reads.
        description: interface and channel.
        port: TCP port in use, if the bus is a server.
        client_command: shell command with which a stock client joins this bus.

    Raises:
        UserError: if the bus cannot be opened.

    """

    def __init__(self, settings: Mapping[str, object]) -> None:
        self._bus = open_can_bus(settings)
        self._carrier = _carrier(self._bus)
        self._kept: Frame | None = None  # arrived during a wait
        self.received = 0
        self.sent = 0
        self.dropped = 0
        self.error_frames = 0
        self.read_errors = 0
        self.description = self._bus.channel_info
        self.port: int | None = getattr(self._bus, "port", None)
        self.client_command = client_command(self._bus, settings)

    def receive(self) -> list[Frame]:
        """Return the arrived frames, oldest first, at most `RECEIVE_LIMIT`, without waiting."""
        carrier = self._carrier
        if carrier is not None and self._kept is None:
            arrived = carrier.receive_frames(RECEIVE_LIMIT)
            if arrived:
                self.received += len(arrived)
            if carrier.messages:
                self.error_frames += len(carrier.messages)
                carrier.messages.clear()
            return arrived
        frames = [] if self._kept is None else [self._kept]
        self._kept = None
        limit = RECEIVE_LIMIT - len(frames)
        for message in itertools.islice(iter(lambda: self._recv(0), None), limit):
            if self._is_ours(message):
                frames.append(as_frame(message))
        return frames

    def wait(self, timeout: float) -> bool:
        """Wait for a frame, at most `timeout` [s]; return whether a frame has arrived.

        The frame is kept for the next `receive()`.
        """
        if self._kept is not None:
            return True
        deadline = time.monotonic() + timeout
        while True:
            message = self._recv(max(0.0, deadline - time.monotonic()))
            if message is not None and self._is_ours(message):
                self._kept = as_frame(message)
                return True
            if time.monotonic() >= deadline:
                return False

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames in this order; frames that the interface does not accept are dropped."""
        if self._carrier is not None:
            given: Any = frames if type(frames) in _AS_THEY_ARE else list(frames)
            count = len(given)
            refused = self._carrier.send_frames(given)
            self.sent += count - refused
            if refused:
                self.dropped += refused
            return
        for frame in frames:
            try:
                self._bus.send(as_message(frame), timeout=0)
            except (can.CanError, OSError):
                self.dropped += 1
            else:
                self.sent += 1

    def report(self, error_class: int) -> None:
        """Send an error frame to the other parties, if the bus is in memory or on TCP.

        Real controllers make error frames themselves, and a kernel refuses those of a program.
        """
        if isinstance(self._bus, SocketcandServerBus | InProcessBus):
            message = can.Message(
                arbitration_id=error_class, is_error_frame=True, data=bytes(_CLASSICAL_BYTES)
            )
            self._bus.send(message, timeout=0)

    def close(self) -> None:
        """Close the interface; a second call has no effect."""
        self._bus.shutdown()

    def __exit__(self, *error: object) -> None:
        self.close()

    def _recv(self, timeout: float) -> can.Message | None:
        try:
            return self._bus.recv(timeout)
        except (can.CanError, OSError):
            self.read_errors += 1
            return None

    def _is_ours(self, message: can.Message) -> bool:
        if message.is_error_frame or message.is_fd:
            self.error_frames += 1
            return False
        self.received += 1
        return True


def _carrier(bus: can.BusABC) -> InProcessBus | SocketcandServerBus | None:
    """Return a bus that carries `Frame` objects; None if received messages need a filter."""
    if isinstance(bus, InProcessBus | SocketcandServerBus) and not bus.filters:
        return bus
    return None
