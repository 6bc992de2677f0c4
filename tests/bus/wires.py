"""A bus under test, and stock python-can nodes on it."""

import re
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import can

from hil_emulator.bus.bus import Bus
from hil_emulator.frame import Frame

PATIENCE_S = 30.0  # a failing test ends after this; a passing one never waits for it


class Wire:
    """A `Bus`, and stock nodes on the same wire."""

    def __init__(self, bus_settings: dict[str, Any], node_settings: dict[str, Any] | None = None):
        self.bus = Bus(bus_settings)
        self._node_settings = node_settings or stock_settings(self.bus.client_command)
        self._nodes: list[can.BusABC] = []
        self._seen: list[Frame] = []

    def join(self) -> can.BusABC:
        """Return a new stock node; polls the bus meanwhile, because the bus may serve the node."""
        with ThreadPoolExecutor(1) as pool:
            joining = pool.submit(lambda: can.Bus(**self._node_settings))
            while not joining.done():
                self.poll()
            self._nodes.append(joining.result())
        return self._nodes[-1]

    def poll(self) -> None:
        """Poll the bus; received frames are kept for `arrived`."""
        self._seen += self.bus.receive()

    def arrived(self, count: int) -> list[Frame]:
        """Return the next `count` frames at the bus, or fewer after a time-out."""
        while len(self._seen) < count and self.bus.wait(PATIENCE_S):
            self.poll()
        frames, self._seen = self._seen[:count], self._seen[count:]
        return frames

    def read(self, node: can.BusABC, count: int) -> list[Frame]:
        """Return the next `count` frames at a node, or fewer after a time-out."""
        frames: list[Frame] = []
        deadline = time.monotonic() + PATIENCE_S
        while len(frames) < count and time.monotonic() < deadline:
            self.poll()
            message = node.recv(0.001)
            if message is not None:
                frames.append(frame_of(message))
        return frames

    def close(self) -> None:
        """Close all nodes and the bus."""
        for node in self._nodes:
            node.shutdown()
        self.bus.close()


def stock_settings(client_command: str) -> dict[str, Any]:
    """Return the python-can settings that a client command, pasted into a shell, would use."""
    arguments = re.search(r"connect\((.*?)\)", client_command)
    assert arguments is not None
    return dict(re.findall(r"(\w+)='?([^',]+)'?", arguments[1]))


def message_of(frame: Frame) -> can.Message:
    """Return a frame as a message of stock nodes."""
    return can.Message(
        arbitration_id=frame.can_id,
        data=frame.data,
        is_remote_frame=frame.remote,
        is_extended_id=frame.extended,
    )


def frame_of(message: can.Message) -> Frame:
    """Return a message of a stock node as a frame."""
    return Frame(
        message.arbitration_id,
        bytes(message.data),
        message.is_remote_frame,
        message.is_extended_id,
    )
