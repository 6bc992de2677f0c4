"""A CAN controller: its transmit queue, and its error counter (ISO 11898-1)."""

import heapq
from collections.abc import Callable, Iterable

from hil_emulator.can_timing.frame_length import priority
from hil_emulator.frame import Frame

ERROR_STEP = 8
"""Added to the transmit error counter for each frame that is destroyed; one that passes takes 1."""
BUS_OFF_ABOVE = 255
"""Of the transmit error counter."""


class CanController:
    """Frames wait by priority, and in the order of their queueing where that is the same.

    Args:
        depth: how many frames can wait; what comes then is lost. None for no limit.

    Attributes:
        lost: frames for which there was no room.
        off_until_ns: end of its time off the bus; None while it is on the bus.
        error_count: the transmit error counter.
        disturbed: asked at the start of each frame, with its time, whether an error frame
            destroys it.

    """

    def __init__(self, depth: int | None = None) -> None:
        self.lost = 0
        self.error_count = 0
        self.off_until_ns: int | None = None
        self.disturbed: Callable[[int], bool] = lambda now_ns: False
        self._depth = depth
        self._order = 0
        self._waiting: list[tuple[int, int, Frame]] = []

    @property
    def head(self) -> tuple[int, int, Frame] | None:
        """Priority, order and frame of what it sends next; None while nothing waits."""
        return self._waiting[0] if self._waiting else None

    def put(self, frames: Iterable[Frame]) -> None:
        """Queue frames; a controller that is off the bus forgets them."""
        if self.off_until_ns is not None:
            return
        for frame in frames:
            if self._depth is not None and len(self._waiting) >= self._depth:
                self.lost += 1
            else:
                self._order += 1
                heapq.heappush(self._waiting, (priority(frame), self._order, frame))

    def passed(self) -> Frame:
        """Return the head, which the others have received."""
        self.error_count = max(0, self.error_count - 1)
        return heapq.heappop(self._waiting)[2]

    def destroyed(self) -> bool:
        """Count an error frame upon the head, which stays; return whether that is bus-off."""
        self.error_count += ERROR_STEP
        return self.error_count > BUS_OFF_ABOVE

    def leave(self, until_ns: int) -> None:
        """Go off the bus; what waits is forgotten."""
        self.off_until_ns = until_ns
        self._waiting.clear()

    def join(self) -> None:
        """Come back to the bus."""
        self.off_until_ns = None
        self.error_count = 0
