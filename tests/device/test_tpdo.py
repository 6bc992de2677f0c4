"""TPDOs of every transmission type (CiA 301 7.2.2), received by a stock master."""

from itertools import pairwise

import pytest
from device_master import (
    CHANNELS,
    EDS,
    NODE_ID,
    READINGS,
    SAFE_CURRENT,
    SYNC,
    TPDO1,
    TPDO2,
    TPDO3,
    Master,
    booted,
)

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.frame import Frame

NS_PER_MS = 1_000_000


def configure(master: Master, number: int, kind: int, timer: int = 0, inhibit: int = 0) -> None:
    """Set a TPDO's type, event timer in ms and inhibit time in 100 us by the rules."""
    record = master.remote.sdo[0x1800 + number - 1]
    cob_id = record[1].raw
    record[1].raw = cob_id | 1 << 31
    record[2].raw, record[3].raw, record[5].raw = kind, inhibit, timer
    record[1].raw = cob_id & ~(1 << 31)


def only(master: Master, number: int, kind: int, timer: int = 0, inhibit: int = 0) -> int:
    """Disable all other TPDOs, start the node and return the TPDO's identifier."""
    for other in range(1, 5):
        if other != number:
            master.remote.sdo[0x1800 + other - 1][1].raw = 1 << 31 | TPDO1
    configure(master, number, kind, timer, inhibit)
    master.start()
    return 0x180 + 0x100 * (number - 1) + NODE_ID


def played(master: Master, kind: int, timer: int, inhibit: int) -> list[tuple[int, Frame]]:
    """Return the frames of a TPDO during SYNC, requests, samples and NMT commands."""
    can_id = only(master, 2, kind, timer, inhibit)
    for tick in range(60):
        if tick % 4 == 0:
            master.measure((*READINGS[:3], READINGS[3] + 1e-5 * tick, READINGS[4]))
        happening = {
            3: [Frame(SYNC)],
            5: [Frame(SYNC), Frame(SYNC)],
            6: [Frame(can_id, remote=True)],
        }.get(tick % 8, [])
        commands = {30: 2, 34: 1, 45: 128}
        if tick in commands:
            happening = [*happening, Frame(0x000, bytes([commands[tick], NODE_ID]))]
        master.network.tick(*happening)
    return [sent for sent in master.network.log if sent[1].can_id == can_id]


def test_stock_master_reads_the_sensors(master: Master) -> None:
    """A master that uses only the EDS reads the default TPDOs in SI."""
    master.remote.tpdo.read()
    master.start()
    master.send(SYNC)
    tpdo = master.remote.tpdo
    names = ("pressure_a", "pressure_b", "supply_pressure")
    shown = [tpdo[1][name].phys for name in names]
    shown += [tpdo[2]["position"].phys, tpdo[3]["load_force"].phys]
    assert shown == pytest.approx(READINGS)
    assert tpdo[4]["position"].phys == pytest.approx(READINGS[3])
    assert tpdo[4]["load_force"].phys == pytest.approx(READINGS[4])


def test_default_tpdos_belong_to_one_sample(master: Master) -> None:
    """TPDO1 to 3 of a tick carry the same sample counter, and it counts the ticks."""
    master.start()
    master.run(5)
    counters = [
        [int.from_bytes(data[at : at + 2], "little") for data in master.data(can_id)]
        for can_id, at in ((TPDO1, 6), (TPDO2, 4), (TPDO3, 4))
    ]
    first = counters[0][0]
    assert counters == [list(range(first, first + 5))] * 3


def test_event_timer_starts_with_operational(master: Master) -> None:
    """The first transmission is one period after the start, the others follow periodically."""
    can_id = only(master, 2, 255, timer=10)
    began = master.network.now_ns / NS_PER_MS - 1  # the tick of the start itself is over
    master.run(45)
    assert [t - began for t in master.times_ms(can_id)] == [10, 20, 30, 40]


def test_event_timer_does_not_drift(node: Node) -> None:
    """With ticks of 0.7 ms a timer of 1 ms fires at the first tick after each millisecond."""
    measured = Measured([0.0] * 5, [0] * 5)
    period_ns, fired = 700_000, []
    for tick in range(1000):
        frames = [Frame(0, bytes([1, NODE_ID]))] if tick == 1 else []
        node.receive(tick * period_ns, frames)
        sent = node.publish(tick * period_ns, measured)
        fired += [tick * period_ns for frame in sent if frame.can_id == TPDO1]
    due = [period_ns + NS_PER_MS * n for n in range(1, len(fired) + 1)]
    assert fired == [-(-t // period_ns) * period_ns for t in due]
    assert len(fired) > 690


def test_event_timer_shorter_than_a_tick_fires_once_per_tick(node: Node) -> None:
    """With ticks of 10 ms a TPDO with a timer of 1 ms is sent once per tick."""
    measured = Measured([0.0] * 5, [0] * 5)
    counts = []
    for tick in range(10):
        node.receive(tick * 10 * NS_PER_MS, [Frame(0, bytes([1, 0]))] if tick == 1 else [])
        sent = node.publish(tick * 10 * NS_PER_MS, measured)
        counts.append(sum(frame.can_id == TPDO1 for frame in sent))
    assert counts == [0, 0] + [1] * 8


@pytest.mark.parametrize("kind", [0, 1, 3, 252, 253, 254, 255])
@pytest.mark.parametrize(("timer", "inhibit"), [(0, 0), (0, 50), (2, 0), (2, 50)])
def test_a_tpdo_is_called_only_when_it_may_send(
    monkeypatch: pytest.MonkeyPatch, kind: int, timer: int, inhibit: int
) -> None:
    """A TPDO called in every tick sends the same frames at the same times."""

    def fresh() -> Master:
        dictionary = Dictionary.from_eds(EDS, NODE_ID)
        return booted(Node(dictionary, CHANNELS, {"valve_current": SAFE_CURRENT}))

    sent = played(fresh(), kind, timer, inhibit)
    monkeypatch.setattr(Tpdo, "wakes_ns", property(lambda _: -1, lambda *_: None), raising=False)
    assert sent == played(fresh(), kind, timer, inhibit)
    assert sent


def test_inhibit_time_holds_events_back(master: Master) -> None:
    """With an inhibit time of 5 ms a timer of 2 ms sends at most every 5 ms."""
    can_id = only(master, 2, 254, timer=2, inhibit=50)
    master.run(60)
    times = master.times_ms(can_id)
    gaps = {later - earlier for earlier, later in pairwise(times)}
    assert len(times) >= 10
    assert min(gaps) >= 5


def test_without_event_timer_a_change_is_the_event(master: Master) -> None:
    """Type 255 without timer is sent at the start, then only after changes."""
    can_id = only(master, 4, 255)
    master.run(10)
    assert len(master.data(can_id)) <= 1
    master.forget()
    master.measure((*READINGS[:3], 0.2, READINGS[4]))
    master.run(10)
    assert [data[:4] for data in master.data(can_id)] == [(2_000_000).to_bytes(4, "little")]


@pytest.mark.parametrize("every", [1, 2, 5, 240])
def test_cyclic_type_answers_every_nth_sync(master: Master, every: int) -> None:
    """Type n is sent with each n-th SYNC after the start."""
    can_id = only(master, 4, every)
    answered = []
    for count in range(1, 2 * every + 2):
        before = len(master.data(can_id))
        master.send(SYNC)
        answered += [count] * (len(master.data(can_id)) - before)
    assert answered == [every * n for n in range(1, (2 * every + 1) // every + 1)]


def test_every_sync_of_a_tick_is_answered(master: Master) -> None:
    """Two SYNCs in one tick trigger two transmissions."""
    can_id = only(master, 4, 1)
    sent = master.network.tick(Frame(SYNC), Frame(SYNC))
    assert [frame.can_id for frame in sent] == [can_id, can_id]


def test_acyclic_type_answers_a_sync_after_a_change(master: Master) -> None:
    """Type 0 is sent only with the first SYNC after a change of its data."""
    can_id = only(master, 4, 0)
    master.send(SYNC)
    master.forget()
    master.send(SYNC)
    assert master.data(can_id) == []
    master.measure((*READINGS[:4], 600.0))
    master.run(5)
    assert master.data(can_id) == []
    master.send(SYNC)
    master.send(SYNC)
    assert len(master.data(can_id)) == 1


def test_type_253_is_sampled_on_request(master: Master) -> None:
    """A remote frame is answered with the data of its tick; there is no other transmission."""
    can_id = only(master, 4, 253)
    master.send(SYNC)
    master.run(5)
    assert master.data(can_id) == []
    master.measure((*READINGS[:3], 0.3, READINGS[4]))
    master.send(can_id, remote=True)
    assert [data[:4] for data in master.data(can_id)] == [(3_000_000).to_bytes(4, "little")]


def test_type_252_keeps_the_sample_of_the_sync(master: Master) -> None:
    """A remote frame is answered with the sample of the last SYNC."""
    can_id = only(master, 4, 252)
    master.send(SYNC)
    assert master.data(can_id) == []
    master.measure((*READINGS[:3], 0.3, READINGS[4]))
    master.send(can_id, remote=True)
    assert [data[:4] for data in master.data(can_id)] == [(1_000_000).to_bytes(4, "little")]


@pytest.mark.parametrize("kind", [1, 255])
def test_remote_frame_gets_any_tpdo_that_allows_it(master: Master, kind: int) -> None:
    """A remote frame is answered once, unless bit 30 of the COB-ID is set."""
    can_id = only(master, 3, kind, timer=1000)
    master.send(can_id, remote=True)
    assert len(master.data(can_id)) == 1
    master.remote.sdo[0x1802][1].raw = 1 << 31 | can_id
    master.remote.sdo[0x1802][1].raw = 1 << 30 | can_id
    master.send(can_id, remote=True)
    assert len(master.data(can_id)) == 1


def test_raw_values_saturate(master: Master) -> None:
    """A reading beyond the range of the object's type is saturated, below and above."""
    master.measure((1e9, -1e9, float("inf"), float("nan"), 0.0004))
    master.run(1)
    names = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
    raw = [master.remote.sdo[name].raw for name in names]
    assert raw == [32767, -32768, 32767, -(2**31), 0]


def test_sample_time_is_the_ticks_time(node: Node, dictionary: Dictionary) -> None:
    """sample_time counts microseconds modulo 2^32."""
    now_ns = (2**32 + 1234) * 1000
    node.receive(now_ns, [])
    node.publish(now_ns, Measured([0.0] * 5, [0] * 5))
    assert dictionary.read(0x2041) == 1234


def test_a_sample_shown_twice_keeps_its_number(node: Node, dictionary: Dictionary) -> None:
    """A tick without a step of the plant is not a new sample, also over a reset."""
    measured = Measured([1e6] * 5, [0] * 5)
    for now_ns in (0, 1_000_000):
        node.receive(now_ns, [])
        node.publish(now_ns, Measured(*measured))
    for now_ns, frames in ((2_000_000, []), (3_000_000, [Frame(0, bytes([129, 0]))])):
        node.receive(now_ns, frames)
        node.publish(now_ns, measured)
        assert (dictionary.read(0x2040), dictionary.read(0x2041)) == (2, 2000)
        assert dictionary.read(0x2010) == 1000
    node.receive(4_000_000, [Frame(0, bytes([129, 0]))])
    node.publish(4_000_000, measured)
    assert dictionary.read(0x2010) == 1000


def test_long_ticks_leave_no_backlog(node: Node) -> None:
    """After one tick of 10 ms a TPDO with a timer of 1 ms continues at its period."""
    measured = Measured([0.0] * 5, [0] * 5)
    times_us = [0, 1000, 11_000, *range(11_100, 15_100, 100)]
    fired = []
    for now_us in times_us:
        frames = [Frame(0, bytes([1, NODE_ID]))] if now_us == 1000 else []
        node.receive(now_us * 1000, frames)
        sent = node.publish(now_us * 1000, measured)
        fired += [now_us for frame in sent if frame.can_id == TPDO1]
    assert fired == [11_000, 12_000, 13_000, 14_000, 15_000]
