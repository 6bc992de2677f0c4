"""Bits of a frame, who wins the arbitration, queues that overflow, frames that are destroyed."""

import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_emulator.can_timing.controller import BUS_OFF_ABOVE, ERROR_STEP
from hil_emulator.can_timing.frame_length import (
    END_BITS,
    crc,
    length,
    priority,
    stuff_bits,
    stuffed_field,
)
from hil_emulator.can_timing.wire import ERROR_BITS, RECOVERY_BITS, TimedWire
from hil_emulator.frame import BUS_ERROR, BUS_OFF, RESTARTED, Frame

BIT_RATE = 500_000
BIT_NS = 2_000
frames = st.builds(
    Frame, st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans(), st.just(False)
) | st.builds(
    Frame, st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8), st.booleans(), st.just(True)
)


def on_the_wire(bits: int, count: int) -> list[int]:
    """Return bits with their stuff bits, as ISO 11898-1 words it."""
    sent: list[int] = []
    for place in range(count - 1, -1, -1):
        sent.append(bits >> place & 1)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1:
            sent.append(1 - sent[-1])
    return sent


def test_checksum_is_that_of_the_catalogue() -> None:
    """CRC-15/CAN of the nine digits is 0x059E (reveng catalogue of CRC algorithms)."""
    assert crc(int.from_bytes(b"123456789", "big"), 72) == 0x059E


def test_an_empty_frame_of_zeros_is_stuffed_after_each_five() -> None:
    """34 dominant bits take six stuff bits, the end of frame and its delimiters ten more."""
    assert length(Frame(0)) == 34 + 6 + END_BITS
    assert length(Frame(0x555, b"\x55" * 8)) <= 98 + 24 + END_BITS


@settings(deadline=None)
@given(frames)
def test_stuff_bits_are_those_of_the_standard(frame: Frame) -> None:
    """Never six equal bits; as many as bit by bit; the field has 34 or 54 bits beside the data."""
    bits, count = stuffed_field(frame)
    sent = on_the_wire(bits, count)
    assert count == (54 if frame.extended else 34) + 8 * len(frame.data)
    assert stuff_bits(bits, count) == len(sent) - count
    assert all(len(set(sent[n : n + 6])) == 2 for n in range(len(sent) - 5))
    assert crc(bits, count) == 0  # what is followed by its own checksum leaves none


@settings(deadline=None)
@given(frames, frames)
def test_the_first_differing_bit_decides(a: Frame, b: Frame) -> None:
    """Dominant wins: the arbitration fields compared bit by bit on the wire."""

    def field(frame: Frame) -> str:
        bits, count = stuffed_field(frame)
        shown = f"{bits:0{count}b}"
        return shown[1:33] if frame.extended else shown[1:14]

    length_ = min(len(field(a)), len(field(b)))
    first, second = field(a)[:length_], field(b)[:length_]
    if first != second:
        assert (priority(a) < priority(b)) == (first < second)


def test_a_full_queue_loses_what_comes_last() -> None:
    """Of five frames four wait; they pass by identifier, each after the one before."""
    wire = TimedWire(BIT_RATE)
    node = wire.attach(depth=4)
    wire.queue(0, node, [Frame(n) for n in (0x500, 0x300, 0x400, 0x200, 0x100)])
    passed, errors = wire.advance(10_000_000)
    assert [p.frame.can_id for p in passed] == [0x200, 0x300, 0x400, 0x500]
    assert (node.lost, errors) == (1, [])
    assert passed[0].done_ns == length(Frame(0x200)) * BIT_NS
    gaps = [b.done_ns - a.done_ns for a, b in itertools.pairwise(passed)]
    assert gaps == [(3 + length(p.frame)) * BIT_NS for p in passed[1:]]


def test_what_has_begun_is_not_interrupted() -> None:
    """The highest priority waits for the end of the frame that is on the wire."""
    wire = TimedWire(BIT_RATE)
    low, high = wire.attach(), wire.attach()
    wire.queue(0, low, [Frame(0x7FF, bytes(8))])
    wire.queue(1, high, [Frame(0)])
    first, second = wire.advance(10_000_000)[0]
    assert (first.sender, second.sender) == (low, high)
    assert second.done_ns == first.done_ns + (3 + length(Frame(0))) * BIT_NS


def test_a_destroyed_frame_comes_again() -> None:
    """Two error frames cost their time and 16 in the counter, of which success takes 1."""
    wire = TimedWire(BIT_RATE)
    node = wire.attach()
    hits = iter([True, True, False])
    node.disturbed = lambda now_ns: next(hits)
    frame = Frame(0x185, b"data")
    wire.queue(0, node, [frame])
    passed, errors = wire.advance(10_000_000)
    assert [p.done_ns for p in passed] == [(3 * length(frame) + 2 * ERROR_BITS) * BIT_NS]
    assert [e.error_class for e in errors] == [BUS_ERROR] * 2
    assert node.error_count == 2 * ERROR_STEP - 1


def test_32_error_frames_in_a_row_are_bus_off() -> None:
    """The node forgets what it would send, and is back after 128 times 11 recessive bits."""
    wire = TimedWire(BIT_RATE)
    node = wire.attach()
    node.disturbed = lambda now_ns: True
    wire.queue(0, node, [Frame(0x185), Frame(0x285)])
    _, errors = wire.advance(100_000_000)
    assert [e.error_class for e in errors] == [BUS_ERROR] * 32 + [BUS_OFF, RESTARTED]
    assert 32 * ERROR_STEP > BUS_OFF_ABOVE >= 31 * ERROR_STEP
    assert errors[-1].now_ns - errors[-2].now_ns == RECOVERY_BITS * BIT_NS
    node.disturbed = lambda now_ns: False
    wire.queue(100_000_000, node, [Frame(0x385)])
    assert [p.frame.can_id for p in wire.advance(200_000_000)[0]] == [0x385]


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_how_often_it_is_asked_makes_no_difference(steps: int) -> None:
    """The same frames queued at the same times pass at the same times."""
    chance = random.Random(1)
    plan = [(at * 250_000, chance.randrange(2048), chance.randbytes(4)) for at in range(300)]
    whole, parts = TimedWire(BIT_RATE), TimedWire(BIT_RATE)
    one, other = whole.attach(), parts.attach()
    found = []
    for place, (at, can_id, data) in enumerate(plan):
        whole.queue(at, one, [Frame(can_id, data)])
        parts.queue(at, other, [Frame(can_id, data)])
        if place % steps == 0:
            found += parts.advance(at + 1)[0]
    found += parts.advance(10**9)[0]
    expected = whole.advance(10**9)[0]
    assert [(p.done_ns, p.frame) for p in found] == [(p.done_ns, p.frame) for p in expected]
    assert len(expected) == 300
