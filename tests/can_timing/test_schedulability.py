"""Response times on the wire against the analysis of the literature, for published message sets."""

import random
from collections import defaultdict

import pytest
from schedulability import BIT_NS, Message, davis, response_times, tindell

from hil_emulator.can_timing.frame_length import END_BITS, INTERMISSION_BITS, Length, length
from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.frame import Frame

BIT_RATE = 125_000
MS = 1_000_000
INTERMISSION_NS = INTERMISSION_BITS * BIT_NS

DAVIS = [Message(7, 5 * MS // 2), Message(7, 7 * MS // 2), Message(7, 7 * MS // 2)]
"""Davis, Burns, Bril, Lukkien, CanController Area Network (CAN) schedulability analysis: refuted,
revisited and revised, Real-Time Systems 35, 2007, table 2: 1 ms each at 125 kbit/s."""

SAE = [
    *(Message(1, 50 * MS, MS // 10), Message(2, 5 * MS, MS // 10), Message(1, 5 * MS, MS // 10)),
    *(Message(2, 5 * MS, MS // 10), Message(1, 5 * MS, MS // 10), Message(2, 5 * MS, MS // 10)),
    *(Message(6, 10 * MS, MS // 5), Message(1, 10 * MS, MS // 5), Message(2, 10 * MS, MS // 5)),
    *(Message(3, 10 * MS, MS // 5), Message(1, 50 * MS, MS // 5)),
    *(Message(4, 100 * MS, 3 * MS // 10), Message(1, 100 * MS, 3 * MS // 10)),
    Message(1, 100 * MS, MS // 5),
    *(Message(3, 1000 * MS, 2 * MS // 5), Message(1, 1000 * MS, 3 * MS // 10)),
    Message(1, 1000 * MS, 3 * MS // 10),
]  # fmt: skip
SAE_RESPONSE_MS = (
    1.544, 2.128, 2.632, 3.216, 3.720, 4.304, 5.192, 8.456, 9.040, 9.696, 10.200, 19.088, 19.592,
    20.096,
)  # fmt: skip
"""The SAE benchmark at 125 kbit/s, its messages of 100 ms or less: Tindell, Burns, Guaranteeing
message latencies on CAN, 1st International CAN Conference, 1994; any message is blocked by one of 8
bytes, and R is from when the message is queued."""


def without_intermission(bits: Length) -> Length:
    """Return a length as the wire takes it: those of the papers include the intermission."""
    return lambda frame: bits(frame) - INTERMISSION_BITS


def frames_of(messages: list[Message], seed: int = 1) -> list[Frame]:
    """Return a frame for each message, by falling priority."""
    chance = random.Random(seed)
    return [Frame(0x100 + n, chance.randbytes(m.size)) for n, m in enumerate(messages)]


def simulate(
    wire: TimedWire, messages: list[Message], frames: list[Frame], offsets: list[int], until_ns: int
) -> dict[int, list[int]]:
    """Return the response times of each message by identifier, each from a node of its own."""
    controllers = [wire.attach() for _ in messages]
    releases = sorted(
        (at, n)
        for n, (message, offset) in enumerate(zip(messages, offsets, strict=True))
        for at in range(offset, until_ns, message.period_ns)
    )
    queued: defaultdict[int, list[int]] = defaultdict(list)
    for at, n in releases:
        wire.queue(at, controllers[n], [frames[n]])
        queued[frames[n].can_id].append(at)
    passed, _ = wire.advance(until_ns + 100 * MS)
    responses: defaultdict[int, list[int]] = defaultdict(list)
    for done_ns, _, frame in passed:
        if frame.can_id in queued:
            began = queued[frame.can_id].pop(0)
            responses[frame.can_id].append(done_ns + INTERMISSION_NS - began)
    return responses


def transmissions(messages: list[Message], bits: Length) -> list[int]:
    """Return the transmission time of each message."""
    return [bits(frame) * BIT_NS for frame in frames_of(messages)]


def test_the_analysis_is_that_of_the_papers() -> None:
    """Printed figures: 2, 3 and 3.5 ms of Davis et al., the table of the SAE benchmark."""
    assert response_times(transmissions(DAVIS, davis), DAVIS) == [2 * MS, 3 * MS, 7 * MS // 2]
    longest = tindell(Frame(0, bytes(8))) * BIT_NS
    responses = response_times(transmissions(SAE, tindell), SAE, longest)
    from_queueing = [(r - m.jitter_ns) / MS for r, m in zip(responses, SAE, strict=True)]
    assert from_queueing[: len(SAE_RESPONSE_MS)] == pytest.approx(SAE_RESPONSE_MS, abs=1e-9)


def test_the_second_instance_is_the_late_one() -> None:
    """The lowest of three messages takes 3 ms first and 3.5 ms then, and misses its deadline."""
    wire = TimedWire(BIT_RATE, without_intermission(davis))
    # the busy period of the lowest priority begins with all three at once
    responses = simulate(wire, DAVIS, frames_of(DAVIS), [0, 0, 0], 7 * MS)
    assert responses[0x102] == [3 * MS, 7 * MS // 2]
    assert responses[0x100][0] == 1 * MS


def test_the_critical_instant_attains_the_bound() -> None:
    """All 17 messages at once, just after one of 8 bytes has begun: each as late as computed."""
    still = [m._replace(jitter_ns=0) for m in SAE]
    wire = TimedWire(BIT_RATE, without_intermission(tindell))
    blocking = Frame(0x7FF, bytes(8))
    wire.queue(0, wire.attach(), [blocking])
    responses = simulate(wire, still, frames_of(SAE), [1] * len(SAE), 100 * MS)
    bounds = response_times(transmissions(SAE, tindell), still, tindell(blocking) * BIT_NS)
    first = [responses[0x100 + n][0] for n in range(len(SAE))]
    assert first == [bound - 1 for bound in bounds]


@pytest.mark.parametrize("seed", range(5))
def test_no_message_is_later_than_the_analysis_says(seed: int) -> None:
    """With the exact bits of its frames and any phases; nor does a message overtake its like."""
    chance = random.Random(seed)
    still = [m._replace(jitter_ns=0) for m in SAE]
    frames = frames_of(SAE, seed)
    actual = [(length(f) + INTERMISSION_BITS) * BIT_NS for f in frames]
    assert all(a <= davis(f) * BIT_NS for a, f in zip(actual, frames, strict=True))
    offsets = [chance.randrange(m.period_ns) for m in SAE]
    responses = simulate(TimedWire(BIT_RATE), still, frames, offsets, 3000 * MS)
    bounds = response_times(actual, still)
    for n, bound in enumerate(bounds):
        assert len(responses[0x100 + n]) >= 2
        assert actual[n] <= max(responses[0x100 + n]) <= bound


def test_the_load_is_that_of_the_periods() -> None:
    """Share of the time: the sum of transmission time over period, within a frame."""
    wire = TimedWire(BIT_RATE)
    frames = frames_of(DAVIS)
    simulate(wire, DAVIS, frames, [0, 0, 0], 3000 * MS)
    computed = sum(
        (length(f) + INTERMISSION_BITS) * BIT_NS / m.period_ns
        for f, m in zip(frames, DAVIS, strict=True)
    )
    assert wire.peak == pytest.approx(computed, rel=5e-3)
    assert END_BITS + INTERMISSION_BITS == 13
