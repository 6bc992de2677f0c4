"""Bits of a frame, who wins the arbitration, queues that overflow, frames that are destroyed."""

import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_emulator.can_timing.controller import BUS_OFF_ABOVE, ERROR_STEP, ErrorState
from hil_emulator.can_timing.frame_length import (
    END_BITS,
    crc,
    length,
    priority,
    stuff_bits,
    stuffed_field,
)
from hil_emulator.can_timing.wire import ERROR_BITS, SEQUENCE_BITS, SEQUENCES, TimedWire
from hil_emulator.frame import BUS_ERROR, BUS_OFF, NO_ACKNOWLEDGE, RESTARTED, Frame

BIT_RATE = 500_000
BIT_NS = 2_000
frames = st.builds(
    Frame, st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans(), st.just(False)
) | st.builds(
    Frame, st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8), st.booleans(), st.just(True)
)


def requested(can_id: int, size: int, extended: bool) -> Frame:
    """Return a remote frame with a length code."""
    return Frame(can_id, bytes(size), True, extended)


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


@given(st.integers(0, 0x7FF), st.integers(0, 8))
def test_a_remote_frame_has_a_length_code_and_no_data(can_id: int, size: int) -> None:
    """Its field is 34 bits whatever length it asks for, and the code stands before the CRC."""
    bits, count = stuffed_field(requested(can_id, size, extended=False))
    assert count == 34
    assert bits >> 15 & 0xF == size
    assert crc(bits, count) == 0
    assert stuff_bits(bits, count) == len(on_the_wire(bits, count)) - count


@settings(deadline=None)
@given(frames)
def test_stuff_bits_are_those_of_the_standard(frame: Frame) -> None:
    """Never six equal bits; as many as bit by bit; 34 or 54 bits in addition to the data."""
    bits, count = stuffed_field(frame)
    sent = on_the_wire(bits, count)
    assert count == (54 if frame.extended else 34) + 8 * len(frame.data) * (not frame.remote)
    assert stuff_bits(bits, count) == len(sent) - count
    assert all(len(set(sent[n : n + 6])) == 2 for n in range(len(sent) - 5))
    assert crc(bits, count) == 0  # data followed by their checksum have the CRC 0


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
    assert node.transmit_errors == 2 * ERROR_STEP - 1


def test_32_error_frames_in_a_row_are_bus_off() -> None:
    """The node forgets what it would send; on an idle bus it is back after 128 times 11 bits."""
    wire = TimedWire(BIT_RATE)
    node = wire.attach()
    node.disturbed = lambda now_ns: True
    wire.queue(0, node, [Frame(0x185), Frame(0x285)])
    _, errors = wire.advance(100_000_000)
    assert [e.error_class for e in errors] == [BUS_ERROR] * 32 + [BUS_OFF, RESTARTED]
    assert 32 * ERROR_STEP > BUS_OFF_ABOVE >= 31 * ERROR_STEP
    assert errors[-1].now_ns - errors[-2].now_ns == SEQUENCES * SEQUENCE_BITS * BIT_NS
    node.disturbed = lambda now_ns: False
    wire.queue(100_000_000, node, [Frame(0x385)])
    assert [p.frame.can_id for p in wire.advance(200_000_000)[0]] == [0x385]


def gone(wire: TimedWire, bits: int) -> int:
    """Let a controller go off the bus at once by frames of so many bits; return when."""
    node = wire.attach()
    node.disturbed = lambda now_ns: True
    wire.queue(0, node, [Frame(0)])
    left_ns = (32 * (bits + ERROR_BITS) + 16 * 8) * BIT_NS  # passive from the 16th on
    errors = wire.advance(left_ns)[1]
    assert (errors[-1].error_class, errors[-1].now_ns) == (BUS_OFF, left_ns)
    return left_ns


def test_under_load_bus_off_lasts_as_long_as_128_frames() -> None:
    """Back-to-back frames show one sequence of eleven recessive bits each, at their end."""
    wire = TimedWire(BIT_RATE)
    left_ns = gone(wire, length(Frame(0)))
    wire.queue(left_ns, wire.attach(), [Frame(0x100, bytes(8))] * 200)
    passed, errors = wire.advance(10**9)
    end = passed[SEQUENCES - 1]
    assert [e.error_class for e in errors] == [RESTARTED]
    assert errors[0].now_ns == end.done_ns + 3 * BIT_NS
    assert end.done_ns - left_ns > 10 * SEQUENCES * SEQUENCE_BITS * BIT_NS


@given(st.lists(st.integers(0, 40), min_size=1, max_size=60))
@settings(deadline=None, max_examples=50)
def test_recovery_counts_sequences_of_recessive_bits(gaps: list[int]) -> None:
    """The bus played bit by bit, with frames after idle times, gives the same moment."""
    wire = TimedWire(BIT_RATE, lambda frame: 60)
    left_ns = gone(wire, 60)
    busy, bits = wire.attach(), []
    for gap in gaps:
        bits += [1] * gap
        wire.queue(left_ns + len(bits) * BIT_NS, busy, [Frame(1)])
        bits += [0] * 52 + [1] * 11  # a frame's last eight bits and the intermission are recessive
    bits += [1] * 2000
    run = sequences = 0
    at = 0
    while sequences < SEQUENCES:
        run, at = run + 1 if bits[at] else 0, at + 1
        if run == SEQUENCE_BITS:
            run, sequences = 0, sequences + 1
    (back,) = wire.advance(10**9)[1]
    assert (back.now_ns - left_ns) // BIT_NS == at


def test_an_error_passive_node_lets_others_go_first() -> None:
    """After its frame it waits eight bits more, in which a frame of lower priority begins."""
    wire = TimedWire(BIT_RATE)
    node, other = wire.attach(), wire.attach()
    wire.queue(0, node, [Frame(0x100), Frame(0x101)])
    wire.queue(0, other, [Frame(0x700)])
    node.transmit_errors = 140
    passed = wire.advance(10**9)[0]
    assert [p.frame.can_id for p in passed] == [0x100, 0x700, 0x101]
    wire.queue(10**9, node, [Frame(0x100), Frame(0x101)])
    first, second = wire.advance(2 * 10**9)[0]
    assert second.done_ns - first.done_ns == (3 + 8 + length(Frame(0x101))) * BIT_NS


def test_error_counters_pass_through_warning_to_passive_and_back() -> None:
    """Sender 8 up and 1 down, receivers 1 up and 1 down; 96 is a warning, above 127 passive."""
    wire = TimedWire(BIT_RATE)
    node, other = wire.attach(), wire.attach()
    hits = iter([True] * 16 + [False] * 100)
    node.disturbed = lambda now_ns: next(hits)
    states = []
    for number in range(60):
        wire.queue(number * 10_000_000, node, [Frame(0x100)])
        wire.advance((number + 1) * 10_000_000)
        states.append(node.error_state)
        assert other.error_state is ErrorState.ACTIVE
    # 16 errors are 128, of which the first frame takes one
    assert states == [ErrorState.WARNING] * 32 + [ErrorState.ACTIVE] * 28
    assert node.transmit_errors == 128 - 60
    assert other.receive_errors == 0


def test_alone_on_the_bus_a_node_is_error_passive_and_never_off() -> None:
    """Without an acknowledgement a frame is repeated for ever; the counter stays at 128."""
    wire = TimedWire(BIT_RATE)
    node = wire.attach()
    node.acknowledged = lambda now_ns: False
    wire.queue(0, node, [Frame(0x100)])
    passed, errors = wire.advance(50_000_000)
    assert (passed, node.error_state) == ([], ErrorState.PASSIVE)
    assert {e.error_class for e in errors} == {NO_ACKNOWLEDGE}
    assert len(errors) > 200
    node.acknowledged = lambda now_ns: True
    assert [p.frame.can_id for p in wire.advance(60_000_000)[0]] == [0x100]


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_how_often_it_is_asked_makes_no_difference(steps: int) -> None:
    """The same frames queued at the same times pass at the same times."""
    chance = random.Random(1)
    plan = [(at * 250_000, chance.randrange(2048), chance.randbytes(4)) for at in range(300)]
    whole, parts = TimedWire(BIT_RATE), TimedWire(BIT_RATE)
    one, other = whole.attach(), parts.attach()
    passed = []
    for place, (at, can_id, data) in enumerate(plan):
        whole.queue(at, one, [Frame(can_id, data)])
        parts.queue(at, other, [Frame(can_id, data)])
        if place % steps == 0:
            passed += parts.advance(at + 1)[0]
    passed += parts.advance(10**9)[0]
    expected = whole.advance(10**9)[0]
    assert [(p.done_ns, p.frame) for p in passed] == [(p.done_ns, p.frame) for p in expected]
    assert len(expected) == 300
