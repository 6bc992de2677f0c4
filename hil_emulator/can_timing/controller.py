"""A CAN controller: its transmit queue, and its fault confinement (ISO 11898-1)."""

import heapq
from collections.abc import Callable, Iterable
from enum import IntEnum

from hil_emulator.can_timing.frame_length import priority
from hil_emulator.frame import Frame

ERROR_STEP = 8
"""Added to the transmit error counter for each frame that is destroyed; one that passes takes 1."""
WARNING_FROM = 96
"""Of either error counter: the bus is heavily disturbed."""
PASSIVE_ABOVE = 127
"""Of either error counter."""
BUS_OFF_ABOVE = 255
"""Of the transmit error counter."""


class ErrorState(IntEnum):
    """Fault confinement state of a controller (ISO 11898-1). A warning changes nothing."""

    ACTIVE = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3


class CanController:
    """Frames wait by priority, and in the order of their queueing where that is the same.

    Args:
        depth: how many frames can wait; what comes then is lost. None for no limit.

    Attributes:
        lost: frames for which there was no room.
        off_until_ns: end of its time off the bus if the bus stays idle; None while it is on it.
        transmit_errors: the transmit error counter.
        receive_errors: the receive error counter.
        suspended_until_ns: an error-passive controller that has sent begins no frame before.
        disturbed: asked at the start of each frame, with its time, whether an error frame
            destroys it.
        acknowledged: asked at the start of each frame, with its time, whether another node
            acknowledges it.

    """

    def __init__(self, depth: int | None = None) -> None:
        self.lost = 0
        self.transmit_errors = self.receive_errors = 0
        self.off_until_ns: int | None = None
        self.suspended_until_ns = 0
        self.disturbed: Callable[[int], bool] = lambda now_ns: False
        self.acknowledged: Callable[[int], bool] = lambda now_ns: True
        self._depth = depth
        self._order = 0
        self._waiting: list[tuple[int, int, Frame]] = []

    @property
    def head(self) -> tuple[int, int, Frame] | None:
        """Priority, order and frame of what it sends next; None while nothing waits."""
        return self._waiting[0] if self._waiting else None

    @property
    def error_state(self) -> ErrorState:
        """Its fault confinement state."""
        worst = max(self.transmit_errors, self.receive_errors)
        if self.off_until_ns is not None:
            return ErrorState.BUS_OFF
        if worst > PASSIVE_ABOVE:
            return ErrorState.PASSIVE
        return ErrorState.WARNING if worst >= WARNING_FROM else ErrorState.ACTIVE

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
        self.transmit_errors = max(0, self.transmit_errors - 1)
        return heapq.heappop(self._waiting)[2]

    def destroyed(self) -> bool:
        """Count an error frame upon the head, which stays; return whether that is bus-off."""
        self.transmit_errors += ERROR_STEP
        return self.transmit_errors > BUS_OFF_ABOVE

    def unacknowledged(self) -> None:
        """Count a missing acknowledgement; alone on a bus a controller stays error passive."""
        if self.transmit_errors <= PASSIVE_ABOVE:
            self.transmit_errors += ERROR_STEP

    def received(self) -> None:
        """Count a frame of another controller."""
        self.receive_errors = min(PASSIVE_ABOVE, max(1, self.receive_errors)) - 1

    def received_error(self) -> None:
        """Count an error frame upon the frame of another controller."""
        self.receive_errors = min(PASSIVE_ABOVE + 1, self.receive_errors + 1)

    def leave(self, until_ns: int) -> None:
        """Go off the bus; what waits is forgotten."""
        self.off_until_ns = until_ns
        self._waiting.clear()

    def overhear(self, start_ns: int, end_ns: int, sequence_ns: int) -> None:
        """Wait for further recessive bits while a frame of another controller passes.

        Its acknowledge delimiter, end and intermission are one sequence of eleven recessive bits.

        Args:
            start_ns: when the frame began; a sequence that it interrupts does not count.
            end_ns: end of its intermission.
            sequence_ns: duration of eleven bits.

        """
        if self.off_until_ns is not None and self.off_until_ns > start_ns:
            missing = -((start_ns - self.off_until_ns) // sequence_ns)
            self.off_until_ns = end_ns + (missing - 1) * sequence_ns

    def join(self) -> None:
        """Come back to the bus."""
        self.off_until_ns = None
        self.transmit_errors = self.receive_errors = 0
