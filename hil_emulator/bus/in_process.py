"""python-can's virtual bus within one process, with frames passed as they are.

python-can makes a deep copy of a message for every receiver and takes two locks per message, which
takes many times the time of a tick. A `Frame` is immutable, so all receivers share it. Parties on
python-can's virtual bus send and receive messages on the same channel.
"""

import queue
import time
from collections.abc import Iterable, Sequence
from typing import Any

import can
from can.interfaces import virtual

from hil_emulator.frame import Burst, Frame

_CLASSICAL_BYTES = 8  # ISO 11898-1

_Inbox = queue.SimpleQueue[Frame | Burst | can.Message]


class InProcessBus(virtual.VirtualBus):
    """A virtual bus on the channels of python-can's virtual bus, faster between its instances.

    Args:
        channel: name of the bus.
        rx_queue_size: most frames in the receive queue, 0 for no limit; a limit costs time.
        **kwargs: as for python-can's virtual bus.

    Attributes:
        messages: received error frames and CAN FD frames; the owner empties the list.

    """

    channel: Any
    queue: Any
    _open: bool

    def __init__(self, channel: Any = None, rx_queue_size: int = 0, **kwargs: Any) -> None:
        super().__init__(channel=channel, rx_queue_size=rx_queue_size, **kwargs)
        self._stock = self.receive_own_messages or self.preserve_timestamps
        if not rx_queue_size:
            inbox: _Inbox = queue.SimpleQueue()
            with virtual.channels_lock:
                self.channel[self.channel.index(self.queue)] = inbox
            self.queue = inbox
        self._unread: list[Frame] = []
        self.messages: list[can.Message] = []
        self._look_round()

    def receive_frames(self, limit: int) -> list[Frame]:
        """Return the arrived frames, at most `limit`, without waiting.

        Error frames and CAN FD frames are appended to `messages`.
        """
        if not self._open:
            self._check_if_open()
        inbox = self.queue
        waiting: int = inbox.qsize()  # this thread is the only reader
        if self._unread or waiting > limit:
            return self._take(waiting, limit)
        arrived: list[Frame] = []
        for _ in range(waiting):
            item = inbox.get_nowait()
            if type(item) is Frame:
                arrived.append(item)
            else:
                arrived += self._frames(item)
        return self._within(arrived, limit) if len(arrived) > limit else arrived

    def _take(self, waiting: int, limit: int) -> list[Frame]:
        """Return the frames kept from the last call, then waiting ones, at most `limit`."""
        arrived, self._unread = self._unread, []
        while waiting and len(arrived) < limit:
            waiting -= 1
            item = self.queue.get_nowait()
            arrived += (item,) if type(item) is Frame else self._frames(item)
        return self._within(arrived, limit)

    def _within(self, arrived: list[Frame], limit: int) -> list[Frame]:
        """Return at most `limit` of the arrived frames, and keep the others."""
        self._unread = arrived[limit:]
        return arrived[:limit]

    def _frames(self, item: Burst | can.Message) -> Iterable[Frame]:
        """Return the frames of a burst or message."""
        if isinstance(item, Burst):
            return item
        if item.is_error_frame or item.is_fd:
            self.messages.append(item)
            return ()
        return (as_frame(item),)

    def send_frames(self, frames: Sequence[Frame]) -> int:
        """Send frames; return the number of frames that a receiver did not accept."""
        if not self._open:
            self._check_if_open()
        if self.channel != self._present:
            self._look_round()
        whole = type(frames) is Burst
        for put in self._alike:
            if whole:
                put(frames)
                continue
            for frame in frames:
                put(frame)
        if not self._others:
            return 0
        return sum(not self._all_took(frame, self._others) for frame in frames)

    def _look_round(self) -> None:
        """Sort the parties on the bus by whether they accept `Frame` objects."""
        self._present = list(self.channel)
        others = [inbox for inbox in self._present if inbox is not self.queue]
        self._alike = [inbox.put for inbox in others if type(inbox) is queue.SimpleQueue]
        self._others = [inbox for inbox in others if type(inbox) is not queue.SimpleQueue]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a message, see `can.BusABC.send`."""
        if self._stock or msg.is_error_frame or msg.is_fd:
            super().send(msg, timeout)
            return
        if self.send_frames([as_frame(msg)]):
            raise can.CanOperationError("the queue of a receiver is full")

    def _all_took(self, frame: Frame, stock: Iterable[Any]) -> bool:
        """Send a frame to parties on python-can's virtual bus; return whether all accepted it."""
        complete = True
        for inbox in stock:
            try:
                message = as_message(frame, timestamp=time.time(), channel=self.channel_id)
                inbox.put(message, block=False)
            except queue.Full:
                complete = False
        return complete

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        arrived: Any
        if self._unread:
            arrived, filtered = self._unread.pop(0), False
        else:
            arrived, filtered = super()._recv_internal(timeout)
        if isinstance(arrived, Burst):
            arrived, *self._unread = arrived
        if isinstance(arrived, Frame):
            return as_message(arrived, timestamp=time.time(), channel=self.channel_id), filtered
        return arrived, filtered


def as_frame(message: can.Message) -> Frame:
    """Return a classical data or remote message of python-can as `Frame`."""
    remote = message.is_remote_frame
    data = bytes(min(message.dlc, _CLASSICAL_BYTES)) if remote else bytes(message.data)
    return Frame(message.arbitration_id, data[:_CLASSICAL_BYTES], remote, message.is_extended_id)


def as_message(frame: Frame, **details: Any) -> can.Message:
    """Return a frame as python-can's message.

    Args:
        frame: frame to convert.
        details: further arguments of `can.Message`.

    """
    can_id, data, remote, extended = frame
    return can.Message(
        arbitration_id=can_id, is_extended_id=extended, is_remote_frame=remote, dlc=len(data),
        data=None if remote else data, **details,
    )  # fmt: skip
