"""The wire itself: one frame at a time, the one of highest priority first."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from hil_emulator.can_timing.controller import CanController, ErrorState
from hil_emulator.can_timing.frame_length import INTERMISSION_BITS, Length, length
from hil_emulator.frame import BUS_ERROR, BUS_OFF, NO_ACKNOWLEDGE, RESTARTED, Frame

ERROR_BITS = 31
"""An error frame at its longest, with the intermission (Tindell, Burns, Guaranteeing message
latencies on CAN, 1994, 5)."""
NO_ACKNOWLEDGE_BITS = 6 + 8 + INTERMISSION_BITS
"""Error flag and delimiter of the sender alone, with the intermission (ISO 11898-1)."""
ACKNOWLEDGED_BITS = 8
"""Of a frame behind its acknowledge slot: a delimiter and the end of frame."""
SUSPEND_BITS = 8
"""An error-passive controller waits so long after the intermission before it sends again."""
SEQUENCES, SEQUENCE_BITS = 128, 11
"""Sequences of recessive bits, and their length, that a controller waits for in bus-off."""

NS_PER_S = 1_000_000_000
WINDOW_NS = NS_PER_S
"""Time over which the bus load is averaged."""


class Passed(NamedTuple):
    """A frame that all others have received.

    Attributes:
        done_ns: its end on the wire, without the intermission.
        sender: whose it is.
        frame: the frame.

    """

    done_ns: int
    sender: CanController
    frame: Frame


class WireError(NamedTuple):
    """What a controller has met with.

    Attributes:
        now_ns: when.
        controller: which one.
        error_class: what it was.

    """

    now_ns: int
    controller: CanController
    error_class: int


class TimedWire:
    """Carries the frames of controllers.

    Args:
        bit_rate: in bit/s.
        length: bits of a frame without the intermission.

    Attributes:
        controllers: those that send.
        load: share of the last full second that it was busy, 0 to 1.
        peak: largest load of a full second.

    """

    def __init__(self, bit_rate: int, length: Length = length) -> None:
        self.controllers: list[CanController] = []
        self.load = self.peak = 0.0
        self._bit_rate = bit_rate
        self._length = length
        self._ready_ns = 0  # when something was last queued
        self._free_ns = 0
        self._flying: list[Passed] = []
        self._errors: list[WireError] = []
        self._window_ns = 0
        self._busy_ns = 0  # within the window

    def attach(self, depth: int | None = None) -> CanController:
        """Return a further controller on the wire."""
        self.controllers.append(CanController(depth))
        return self.controllers[-1]

    def queue(self, now_ns: int, sender: CanController, frames: Iterable[Frame]) -> None:
        """Let a controller send frames from now on."""
        self._run(now_ns)
        self._ready_ns = now_ns
        sender.put(frames)

    def advance(self, now_ns: int) -> tuple[Sequence[Passed], Sequence[WireError]]:
        """Return what has passed, and which errors there were, since this was last asked."""
        self._run(now_ns)
        self._measure(now_ns)
        for controller in self.controllers:
            if controller.off_until_ns is not None and controller.off_until_ns <= now_ns:
                self._errors.append(WireError(controller.off_until_ns, controller, RESTARTED))
                controller.join()
        passed = [p for p in self._flying if p.done_ns <= now_ns]
        self._flying = self._flying[len(passed) :]
        errors, self._errors = self._errors, []
        return passed, errors

    def _run(self, until_ns: int) -> None:
        """Begin every transmission that begins before a time."""
        while True:
            waiting = [c for c in self.controllers if c.head is not None]
            if not waiting:
                return
            allowed_ns = min(c.suspended_until_ns for c in waiting)
            start_ns = max(self._free_ns, self._ready_ns, allowed_ns)
            if start_ns >= until_ns:
                return
            self._measure(start_ns)
            ready = [c for c in waiting if c.suspended_until_ns <= start_ns]
            self._transmit(start_ns, min(ready, key=_turn))

    def _transmit(self, start_ns: int, sender: CanController) -> None:
        assert sender.head is not None
        bits = self._length(sender.head[2])
        others = [c for c in self.controllers if c is not sender]
        if sender.disturbed(start_ns):
            self._destroy(start_ns, bits, sender)
            for other in others:
                other.received_error()
        elif not sender.acknowledged(start_ns):
            bits += NO_ACKNOWLEDGE_BITS - ACKNOWLEDGED_BITS
            self._free_ns = start_ns + self._ns(bits)
            self._errors.append(WireError(self._free_ns, sender, NO_ACKNOWLEDGE))
            sender.unacknowledged()
        else:
            done_ns = start_ns + self._ns(bits)
            self._flying.append(Passed(done_ns, sender, sender.passed()))
            self._free_ns = start_ns + self._ns(bits + INTERMISSION_BITS)
            for other in others:
                other.received()
        self._busy_ns += self._free_ns - start_ns
        if sender.error_state is ErrorState.PASSIVE:
            sender.suspended_until_ns = self._free_ns + self._ns(SUSPEND_BITS)
        for other in others:
            other.overhear(start_ns, self._free_ns, self._ns(SEQUENCE_BITS))

    def _destroy(self, start_ns: int, bits: int, sender: CanController) -> None:
        """Let an error frame destroy what a controller sends."""
        self._free_ns = start_ns + self._ns(bits + ERROR_BITS)
        self._errors.append(WireError(self._free_ns, sender, BUS_ERROR))
        if sender.destroyed():
            self._errors.append(WireError(self._free_ns, sender, BUS_OFF))
            sender.leave(self._free_ns + SEQUENCES * self._ns(SEQUENCE_BITS))

    def _measure(self, now_ns: int) -> None:
        """Close the windows that have ended; a frame counts in that in which it began."""
        while now_ns >= self._window_ns + WINDOW_NS:
            self.load = self._busy_ns / WINDOW_NS
            self.peak = max(self.peak, self.load)
            self._window_ns += WINDOW_NS
            self._busy_ns = 0

    def _ns(self, bits: int) -> int:
        return bits * NS_PER_S // self._bit_rate


def _turn(controller: CanController) -> int:
    assert controller.head is not None
    return controller.head[0]
