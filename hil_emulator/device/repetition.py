"""TPDOs that event timer and SYNC alone send, out of a record that somebody else packs.

While nothing else happens to a node, what its TPDOs carry follows from the sample alone. Whoever
samples can then pack all of it at once, and the node only takes it apart.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hil_emulator.device.entry import Entry
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.frame import Frame

COUNT, TIME = -1, -2
"""In place of a channel: the number of the sample, and its time [us]."""

WORD_BITS = 32
"""Longest word that is packed elsewhere: whoever computes with float64 holds it exactly."""

_BYTE = 8


class Shown(NamedTuple):
    """What an integer object shows: round(SI / factor), within the bounds of its type.

    Attributes:
        source: position of the channel in `Measured`, or `COUNT` or `TIME`.
        factor: SI per digit.
        low: smallest number of digits; what is added to a count or time.
        high: largest number of digits; the mask of what is left of a count or time.

    """

    source: int
    factor: float
    low: int
    high: int


class Word(NamedTuple):
    """Where a record has what.

    Attributes:
        shown: what the word shows.
        start: its first byte.
        size: its bytes, the least significant first.

    """

    shown: Shown
    start: int
    size: int


@dataclass
class _Timer:
    """TPDOs whose event timers elapse together; each is a bit of `mask`."""

    next_ns: int
    period_ns: int
    mask: int


class Repetition:
    """The TPDOs of a node at rest.

    Args:
        tpdos: all that exist, by number; each of them `repeats`.
        shown: what objects show, by entry.

    Attributes:
        words: what stands where in the record.
        size: bytes of the record.
        place: where in it this node's part begins.
        passed: how many samples have been published since it began.
        now_ns: time of the last.

    Raises:
        LookupError: a TPDO carries something else.

    """

    def __init__(self, tpdos: Sequence[Tpdo], shown: Mapping[Entry, Shown]) -> None:
        self._tpdos = [t for t in tpdos if t.period_ns or t.parameters.synchronous]
        self.words = tuple(_words([t.parameters.mapping.placed() for t in self._tpdos], shown))
        sizes = [tpdo.parameters.mapping.size for tpdo in self._tpdos]
        self.size = sum(sizes)
        self._take_apart = struct.Struct("".join(f"{size}s" for size in sizes)).unpack_from
        self._head = [(t.parameters.can_id, t.parameters.extended) for t in self._tpdos]
        self._heads: dict[int, list[tuple[int, int, bool]]] = {0: []}
        self._cyclic = [(t, 1 << i) for i, t in enumerate(self._tpdos) if not t.period_ns]
        self._timers: list[_Timer] = []
        self.place = self.passed = self.now_ns = 0

    def begin(self) -> None:
        """Take over the event timers."""
        self.passed = 0
        timers: dict[tuple[int, int], _Timer] = {}
        for i, tpdo in enumerate(self._tpdos):
            if tpdo.period_ns:
                at = tpdo.next_ns, tpdo.period_ns
                timers.setdefault(at, _Timer(*at, 0)).mask |= 1 << i
        self._timers = list(timers.values())

    def end(self) -> None:
        """Give the event timers back."""
        for timer in self._timers:
            for i, tpdo in enumerate(self._tpdos):
                if timer.mask >> i & 1:
                    tpdo.next_ns = tpdo.wakes_ns = timer.next_ns

    def publish(self, now_ns: int, record: bytes | bytearray) -> list[Frame]:
        """Return the frames that are due with a new sample, by number.

        Args:
            now_ns: present time [ns].
            record: what they carry.

        """
        self.passed += 1
        self.now_ns = now_ns
        due = 0
        for timer in self._timers:
            if now_ns >= timer.next_ns:
                due |= timer.mask
                # it never drifts, as in `Tpdo.publish`
                timer.next_ns += ((now_ns - timer.next_ns) // timer.period_ns + 1) * timer.period_ns
        for tpdo, bit in self._cyclic:
            if tpdo.requests:
                due |= bit
                if tpdo.requests > 1:
                    return self._often(due, record)
        if due not in self._heads:
            self._choose(due)
        for tpdo, _ in self._cyclic:
            tpdo.requests = 0
        parts = self._take_apart(record, self.place)
        new = tuple.__new__  # a frame as `Frame()` makes it, in a third of the time
        frames: list[Frame] = []
        for i, can_id, extended in self._heads[due]:
            frames.append(new(Frame, (can_id, parts[i], False, extended)))
        return frames

    def _choose(self, due: int) -> list[tuple[int, int, bool]]:
        """Return the number, identifier and kind of identifier of the TPDOs that are due."""
        self._heads[due] = [(i, *self._head[i]) for i in range(len(self._head)) if due >> i & 1]
        return self._heads[due]

    def _often(self, due: int, record: bytes | bytearray) -> list[Frame]:
        """Return the frames of a tick in which SYNC came more than once."""
        for tpdo, bit in self._cyclic:
            due |= bit * (tpdo.requests > 0)
        frames: list[Frame] = []
        parts = self._take_apart(record, self.place)
        for i, can_id, extended in self._choose(due):
            tpdo = self._tpdos[i]
            frames += [Frame(can_id, parts[i], False, extended)] * (tpdo.requests or 1)
            tpdo.requests = 0
        return frames


def _words(
    places: Sequence[Iterable[tuple[int, Entry]]], shown: Mapping[Entry, Shown]
) -> Iterable[Word]:
    """Yield the words of frames that follow each other in a record."""
    begin = 0
    for placed in places:
        end = 0
        for bit, entry in placed:
            if bit % _BYTE or entry.type.bits % _BYTE:
                raise LookupError
            yield Word(shown[entry], begin + bit // _BYTE, entry.type.size)
            end = bit + entry.type.bits
        begin += end // _BYTE
