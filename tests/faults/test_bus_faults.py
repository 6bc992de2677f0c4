"""Bus faults as a controller sees them: frames missing, late, doubled, wrong."""

import struct
from typing import Any

import pytest
from rigs import NODE, START, bench, reference, set_point
from runs import BEGIN, END, TICKS, Run, codes, count, run, sound

from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.faults.active import MOST, MOST_FRAMES
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped


def of(heard: Run, can_id: int, first: int = BEGIN, last: int = END) -> list[bytes]:
    """Return the data of the frames with a COB-ID."""
    return [f.data for tick in heard[first:last] for f in tick if f.can_id == can_id]


TRACELESS: list[tuple[str, str, dict[str, Any]]] = [
    ("tpdo2", "drop", {"probability": 0.3}),
    ("tpdo2", "delay", {"time": "5 ms"}),
    ("tpdo2", "duplicate", {"copies": 2}),
    ("tpdo2", "corrupt", {"bits": 3}),
    ("0x285", "reorder", {}),
    ("tpdo2", "wrong_length", {"length": 4}),
    ("node", "silence", {}),
    ("bus", "babbling", {"can_id": "0x001", "frames": 3}),
    ("node", "heartbeat_stop", {}),
]


@pytest.mark.parametrize(("target", "kind", "options"), TRACELESS)
def test_its_end_leaves_no_trace(target: str, kind: str, options: dict[str, Any]) -> None:
    """What it does to frames on their way out is over with the last frame held back."""
    heard = run(target, kind, **options)
    assert heard[:BEGIN] == sound()[:BEGIN]
    first = [f for f in heard[END] if f in sound()[END]]  # before them come those held back
    assert first == sound()[END]
    assert heard[END + 1 :] == sound()[END + 1 :]


def test_dropped_frames_leave_gaps_in_the_counter() -> None:
    """About a third of TPDO2 is missing; TPDO1 is complete."""
    heard = run("tpdo2", "drop", probability=0.3)
    assert 50 < count(heard, 0x285) < 90
    assert count(heard, 0x185) == 100


def test_lost_set_points_end_in_the_safe_state() -> None:
    """With RPDO1 dropped the node reports 0x8250 after 20 ms, as without a controller."""
    heard = run("rpdo1", "drop")
    assert codes(heard) == [0x8250, 0x0000]


def test_delayed_frames_come_late_and_complete() -> None:
    """TPDO2 arrives 5 ms after the tick in which it was sent; all of them arrive."""
    heard = run("tpdo2", "delay", time="5 ms")
    assert of(heard, 0x285, BEGIN, BEGIN + 5) == []
    assert of(heard, 0x285) == of(sound(), 0x285)[:-5]
    assert of(heard, 0x285, BEGIN, TICKS) == of(sound(), 0x285, BEGIN, TICKS)


def test_duplicated_frames_come_three_times() -> None:
    """Two copies follow each frame."""
    heard = run("tpdo2", "duplicate", copies=2)
    assert of(heard, 0x285) == [data for data in of(sound(), 0x285) for _ in range(3)]


def test_corrupt_frames_differ_in_as_many_bits() -> None:
    """Three bits of each frame are inverted."""
    pairs = zip(of(run("tpdo2", "corrupt", bits=3), 0x285), of(sound(), 0x285), strict=True)
    inverted = {
        (int.from_bytes(a, "little") ^ int.from_bytes(b, "little")).bit_count() for a, b in pairs
    }
    assert inverted == {3}


def test_reordered_frames_change_places() -> None:
    """Among TPDO2 alone nothing is lost; it comes after its successor on the bus."""
    heard = run("0x285", "reorder")
    order = [f.can_id for f in heard[BEGIN + 1] if f.can_id in (0x185, 0x285, 0x385)]
    assert order == [0x185, 0x385, 0x285]
    assert of(heard, 0x285, BEGIN, TICKS) == of(sound(), 0x285, BEGIN, TICKS)


def test_a_wrong_length_is_seen_on_both_sides() -> None:
    """The controller gets TPDO2 of 4 bytes; the node answers a short RPDO with 0x8210."""
    assert {len(data) for data in of(run("tpdo2", "wrong_length", length=4), 0x285)} == {4}
    assert codes(run("rpdo1", "wrong_length", length=2))[0] == 0x8210


def test_a_silent_node_still_hears() -> None:
    """Not one frame comes from it, and afterwards the rod is where the set points moved it."""
    heard = run("node", "silence")
    assert [f for tick in heard[BEGIN:END] for f in tick] == []
    assert heard[END:] == sound()[END:]


def test_a_babbling_node_fills_the_bus() -> None:
    """Three frames of high priority in each tick, in front of all others."""
    heard = run("bus", "babbling", can_id="0x001", frames=3)
    assert all([f.can_id for f in tick[:3]] == [0x001] * 3 for tick in heard[BEGIN:END])
    assert [tick[3:] for tick in heard[BEGIN:END]] == sound()[BEGIN:END]


def test_an_injected_emergency_is_the_nodes_own() -> None:
    """It is sent, stands in the error register, and its end is reported."""
    with bench(reference()) as b:
        b.ticks(3)
        with b.rig.fault("node", "emcy", code="0x5000"):
            b.tick()
            assert b.rig.nodes[0].dictionary.read(0x1001) == 0x81
        b.ticks(2)
        assert b.rig.nodes[0].dictionary.read(0x1001) == 0
    codes_seen = [struct.unpack_from("<H", f.data)[0] for f in b.heard if f.can_id == 0x085]
    assert codes_seen == [0x5000, 0x0000]


def test_the_heartbeat_can_stop_while_all_else_goes_on() -> None:
    """No heartbeat for three periods; PDOs come meanwhile, and heartbeats afterwards."""
    with bench(reference()) as b:
        b.ticks(3)
        b.rig.nodes[0].dictionary.write(0x1017, 0, 10)
        b.tick(START)
        with b.rig.fault("node", "heartbeat_stop"):
            heard = b.ticks(50, set_point(0.0))
        assert not [f for f in heard if f.can_id == 0x700 + NODE]
        assert len([f for f in heard if f.can_id == 0x185]) >= 49
        assert [f for f in b.ticks(11) if f.can_id == 0x700 + NODE]


def test_a_reset_node_boots_and_waits() -> None:
    """Boot-up, then PRE-OPERATIONAL: no PDO until it is started again."""
    heard = run("node", "reset")
    assert of(heard, 0x705) == [b"\0"]
    assert count(heard, 0x185, BEGIN + 1) == 0
    with bench(reference()) as b:
        b.ticks(3)
        with b.rig.fault("node", "reset"):
            b.ticks(3)
            b.tick(START)
            assert [f.can_id for f in b.ticks(2) if f.can_id == 0x185]


def test_a_node_that_was_bus_off_says_so_when_it_is_back() -> None:
    """Nothing for 100 ms, not even the loss of the set points; then 0x8140 and its end."""
    heard = run("node", "bus_off")
    assert [f for tick in heard[BEGIN:END] for f in tick] == []
    assert codes(heard) == [0x8140, 0x0000]


def test_an_unplugged_cable_is_silent_and_costs_the_set_points() -> None:
    """No frame in either direction; afterwards the node reports the missed ones and continues."""
    heard = run("bus", "interface_down")
    assert [f for tick in heard[BEGIN:END] for f in tick] == []
    assert count(heard, 0x185, END, TICKS) == 100


def test_frames_on_their_way_in_can_be_late_too() -> None:
    """An SDO request delayed by 10 ms is answered 10 ms later."""
    request = Frame(0x600 + NODE, bytes.fromhex("4000100000000000"))
    with bench(reference()) as b:
        b.ticks(3)
        with b.rig.fault("sdo", "delay", time="10 ms"):
            b.tick(request)
            answers = [[f.can_id for f in b.tick() if f.can_id == 0x585] for _ in range(25)]
    assert answers.index([0x585]) == 19  # request and answer are each 10 ms late


def test_one_node_of_several_can_be_meant() -> None:
    """Of four instruments on one bus the load cell alone is silent; node 9 is not there."""
    files = ["configs/hyq_knee.toml", "configs/hyq_knee_separate.toml"]
    with bench(load([shipped(name) for name in files])) as b:
        b.ticks(3)
        for node in b.rig.nodes:
            node.dictionary.write(0x1017, 0, 10)
        b.ticks(20)
        with b.rig.fault("node6", "silence"), b.rig.fault("node7.heartbeat", "drop"):
            b.tick()
            heard = {f.can_id for f in b.ticks(30)}
        assert {0x705, 0x708} <= heard
        assert not {0x706, 0x707} & heard
        assert {0x705, 0x706, 0x707, 0x708} <= {f.can_id for f in b.ticks(30)}
        with pytest.raises(UserError, match="no node 9; there are 5, 6, 7, 8"):
            b.rig.fault("node9", "reset")


def test_faults_upon_faults_fill_no_memory() -> None:
    """Five that send each frame 101 times would make 10^10 of one; there is an end to frames."""
    with bench(reference()) as b:
        for _ in range(5):
            b.rig.fault("bus", "duplicate", copies=100)
        assert max(len(b.tick(START)) for _ in range(3)) <= MOST_FRAMES


def test_faults_have_a_number_that_a_tick_can_bear() -> None:
    """The next one is refused, until one of them is ended."""
    with bench(reference()) as b:
        running = [b.rig.fault("supply", "droop") for _ in range(MOST)]
        with pytest.raises(UserError, match="end some of them"):
            b.rig.fault("supply", "droop")
        running[0].end()
        b.rig.fault("supply", "droop")
