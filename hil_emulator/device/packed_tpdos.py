"""TPDOs on the fast path: only event timer and SYNC send them, and a record holds their data.

Their data follow from the sample alone. The machine code that samples packs them into the record,
and the node cuts the record into frames.
"""

import functools
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.nmt import State
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.frame import NO_FRAMES, Burst, Frame

COUNT, TIME = -1, -2
"""In place of a channel: the number of the sample, and its time [us]."""

WORD_BITS = 32
"""Longest word of a record: the machine code computes with float64, which holds it exactly."""

_BYTE = 8

_Chosen = tuple[Sequence[tuple[int, bool]], Callable[[bytes], Sequence[bytes]]]
"""The parts of a `Burst` without the data."""


class Shown(NamedTuple):
    """Content of an integer object: round(SI / factor), saturated to its type.

    Attributes:
        source: position of the channel in `Measured`, or `COUNT` or `TIME`.
        factor: SI per digit.
        low: smallest number of digits; for a count or time the number that is added.
        high: largest number of digits; for a count or time the mask of the sum.

    """

    source: int
    factor: float
    low: int
    high: int


class Word(NamedTuple):
    """One word of a record.

    Attributes:
        shown: content of the word.
        start: its first byte.
        size: its bytes, the least significant first.

    """

    shown: Shown
    start: int
    size: int


class PackedTpdos:
    """The TPDOs of a node on the fast path.

    Args:
        tpdos: all existing TPDOs, by number; `repeats` is true for each.
        shown: content of the objects, by entry.

    Attributes:
        words: content of the record.
        size: bytes of the record.
        passed: number of samples published since `begin`.
        now_ns: time of the last sample.

    Raises:
        LookupError: a TPDO carries an object that is not in `shown`.

    """

    def __init__(self, tpdos: Sequence[Tpdo], shown: Mapping[Entry, Shown]) -> None:
        self._tpdos = [t for t in tpdos if t.period_ns or t.parameters.synchronous]
        self.words = tuple(_words([t.parameters.mapping.placed() for t in self._tpdos], shown))
        self.size = sum(tpdo.parameters.mapping.size for tpdo in self._tpdos)
        self._cyclic = [(t, 1 << i) for i, t in enumerate(self._tpdos) if not t.period_ns]
        self._leaders: dict[Tpdo, Tpdo] = {}
        self._timed: list[tuple[Tpdo, int]] = []
        self._due: dict[int, _Chosen] = {}
        self._place = self.passed = self.now_ns = 0
        self._heartbeat: Heartbeat

    def move_to(self, place: int) -> None:
        """Read the data from another place in the record from now on."""
        self._place = place
        self._due.clear()

    def begin(self, heartbeat: Heartbeat) -> None:
        """Start counting samples; send a heartbeat with the TPDOs."""
        self.passed = 0
        self._heartbeat = heartbeat
        leaders: dict[tuple[int, int], Tpdo] = {}
        bits: dict[Tpdo, int] = {}
        for i, tpdo in enumerate(self._tpdos):
            if tpdo.period_ns:
                leader = leaders.setdefault((tpdo.next_ns, tpdo.period_ns), tpdo)
                self._leaders[tpdo] = leader
                bits[leader] = bits.get(leader, 0) | 1 << i
        self._timed = list(bits.items())

    def end(self) -> None:
        """Set the event timers of those that elapsed together with another."""
        for tpdo, leader in self._leaders.items():
            tpdo.next_ns = leader.next_ns

    def publish(self, now_ns: int, record: bytearray) -> Sequence[Frame]:
        """Return the frames that are due with a new sample, by number.

        Args:
            now_ns: present time [ns].
            record: their data.

        """
        self.passed += 1
        self.now_ns = now_ns
        due = 0
        for tpdo, bits in self._timed:
            if now_ns >= tpdo.next_ns:
                due |= bits
                tpdo.next_ns += tpdo.period_ns
                if tpdo.next_ns <= now_ns:
                    tpdo.skip_elapsed(now_ns)
        for tpdo, bit in self._cyclic:
            if tpdo.requests:
                due |= bit
                if tpdo.requests > 1:
                    return self._each(now_ns, due, record)
                tpdo.requests = 0
        if now_ns >= self._heartbeat.due_ns:
            return self._each(now_ns, due, record)
        if not due:
            return NO_FRAMES
        heads, parts = self._due.get(due) or self._choose(due)
        return Burst(heads, parts, bytes(record))

    def _choose(self, due: int) -> _Chosen:
        """Return the identifiers of the TPDOs that are due, and the reader of their data."""
        numbers = [i for i in range(len(self._tpdos)) if due >> i & 1]
        sizes = [t.parameters.mapping.size for t in self._tpdos]
        chosen = [f"{size}{'s' if i in numbers else 'x'}" for i, size in enumerate(sizes)]
        heads = [(t.parameters.can_id, t.parameters.extended) for t in self._tpdos]
        parts = struct.Struct("".join(chosen)).unpack_from
        selection = [heads[i] for i in numbers], functools.partial(_from, parts, self._place)
        self._due[due] = selection
        return selection

    def _each(self, now_ns: int, due: int, record: bytearray) -> Sequence[Frame]:
        """Return the frames of a tick with a heartbeat, or with SYNC more than once."""
        for tpdo, bit in self._cyclic:
            due |= bit * (tpdo.requests > 0)
        heads, parts = self._due.get(due) or self._choose(due)
        tpdos = [t for i, t in enumerate(self._tpdos) if due >> i & 1]
        frames: list[Frame] = []
        for tpdo, frame in zip(tpdos, Burst(heads, parts, bytes(record)), strict=True):
            frames += [frame] * (tpdo.requests or 1)
            tpdo.requests = 0
        self._heartbeat.publish(now_ns, State.OPERATIONAL, frames)  # error control comes last
        return frames


def _from(
    parts: Callable[[bytes, int], Sequence[bytes]], place: int, record: bytes
) -> Sequence[bytes]:
    return parts(record, place)


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
