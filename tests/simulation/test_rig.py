"""The whole emulator in one process: plant, sensors, node, bus and clock."""

import dataclasses
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from rigs import START, Bench, bench, reference, set_point

from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.simulation.clock import Clock, FollowSync, LockStep, WallClock

MS = 1_000_000


def two_seconds(config: Configuration, clock: Clock) -> list[Frame]:
    """Return the frames of 2 s in which a script moves the rod."""
    with bench(config, clock) as b:
        b.ticks(10)
        b.tick(START)
        for k in range(1989):
            current = 1.5 * math.sin(2 * math.pi * 2 * k * 1e-3)
            b.tick(set_point(current), *([Frame(0x080)] if k % 10 == 0 else []))
        return b.heard


@pytest.fixture(scope="module")
def lock_step_frames() -> list[Frame]:
    """Return the frames of the reference machine in 2 s of lock-step."""
    return two_seconds(reference(), LockStep())


def test_wall_clock_and_lock_step_send_the_same_frames(lock_step_frames: list[Frame]) -> None:
    """Frames of 2 s are byte-identical in real and in simulated time."""
    assert two_seconds(reference(), WallClock(MS)) == lock_step_frames
    assert len(lock_step_frames) > 6000


def test_the_seed_decides_the_noise(lock_step_frames: list[Frame]) -> None:
    """The same seed gives the same frames, another seed other frames of the same number."""
    assert two_seconds(reference(), LockStep()) == lock_step_frames
    other = two_seconds(dataclasses.replace(reference(), seed=2), LockStep())
    assert other != lock_step_frames
    assert [f.can_id for f in other] == [f.can_id for f in lock_step_frames]


def test_every_tpdo_is_sent_at_its_rate(lock_step_frames: list[Frame]) -> None:
    """TPDOs are sent once per millisecond, and the sample counter has no gap."""
    for can_id in (0x185, 0x285, 0x385):
        counters = [
            struct.unpack_from("<H", f.data, len(f.data) - 2)[0]
            for f in lock_step_frames
            if f.can_id == can_id
        ]
        assert len(counters) >= 1988
        assert set(np.diff(counters) % 0x10000) == {1}


@pytest.fixture
def moving() -> Bench:
    """Yield a bench whose node is OPERATIONAL."""
    with bench(reference()) as b:
        b.ticks(5)
        b.tick(START)
        yield b


def test_a_positive_current_extends_the_rod(moving: Bench) -> None:
    """1 mA for 100 ms extends the rod, -1 mA retracts it, and the PDO shows the position."""

    def position() -> float:
        frames = [f for f in moving.tick(set_point(0)) if f.can_id == 0x285]
        return struct.unpack_from("<i", frames[-1].data)[0] * 1e-7

    start = position()
    moving.ticks(100, set_point(1.0))
    out = position()
    moving.ticks(100, set_point(-1.0))
    assert out > start + 0.005
    assert position() < out - 0.003


def test_without_set_points_the_current_falls_back_to_safe(moving: Bench) -> None:
    """20 ms after the last set point the node sends 0x8250 and centres the valve."""
    moving.ticks(30, set_point(1.0))
    assert moving.rig.plant.inputs.valve_current == pytest.approx(1e-3)
    sent = moving.ticks(25)
    codes = [struct.unpack_from("<H", f.data)[0] for f in sent if f.can_id == 0x085]
    assert codes == [0x8250]
    assert moving.rig.plant.inputs.valve_current == 0.0


def test_a_sensor_out_of_range_raises_an_emergency() -> None:
    """A supply above the transducer's range is reported once, as is its return."""
    config = reference()
    config = dataclasses.replace(config, plant=config.plant | {"supply_pressure": 300e5})
    with bench(config) as b:
        sent = b.ticks(50)
        codes = [struct.unpack_from("<H", f.data)[0] for f in sent if f.can_id == 0x085]
        assert codes == [0xFF10 + 2]
        b.rig.plant.parameters.supply_pressure = 160e5
        sent = b.ticks(50)
        codes = [struct.unpack_from("<H", f.data)[0] for f in sent if f.can_id == 0x085]
        assert codes == [0x0000]


def test_follow_sync_moves_one_tick_per_sync() -> None:
    """Five SYNC messages advance the time by five ticks, with five answers."""
    config = reference()
    with bench(config) as b:
        follow = FollowSync(b.rig.bus, config.sync_period_ns)  # type: ignore[arg-type]
        follow.serve = b.rig.serve
        b.rig.bus = follow
        b.clock = follow
        b.tick(Frame(0x080))
        for k in range(5):
            sent = b.tick(START, Frame(0x080)) if k == 0 else b.tick(Frame(0x080))
            assert [f.can_id for f in sent if f.can_id == 0x485] == [0x485]
        assert b.rig.now_ns == 6 * MS


def test_a_hundred_thousand_random_frames_do_not_stop_the_node(moving: Bench) -> None:
    """After frames of any ID, length and kind, 100 per millisecond, an SDO read is answered."""
    random = np.random.default_rng(7)
    for _ in range(1000):
        ids = random.integers(0, 0x800, 100)
        kinds = random.integers(0, 10, 100)
        moving.tick(
            *(
                Frame(int(i), b"" if k == 1 else random.bytes(k % 9), k == 1, k == 2)
                for i, k in zip(ids, kinds, strict=True)
            )
        )
    moving.ticks(5, Frame(0x000, bytes([130, 5])))
    moving.ticks(1100)
    answers = moving.ticks(3, Frame(0x605, bytes.fromhex("4000100000000000")))
    assert Frame(0x585, bytes.fromhex("4300100098010000")) in answers


def test_a_recording_holds_readings_and_true_values(moving: Bench) -> None:
    """Each tick has a row with time, set point, the reading of the PDO and the true value."""
    moving.ticks(50, set_point(0.5))
    (frame,) = [f for f in moving.tick(set_point(0.5)) if f.can_id == 0x285]
    table = moving.recorder.table()
    assert len(table["time"]) == moving.rig.now_ns // MS
    assert table["valve_current"][-1] == pytest.approx(5e-4)
    assert table["position"][-1] == pytest.approx(struct.unpack_from("<i", frame.data)[0] * 1e-7)
    assert table["model.position"][-1] == pytest.approx(table["position"][-1], abs=3e-6)


def test_the_nodes_of_a_rig_communicate() -> None:
    """Node 6 monitors node 5's heartbeat and sends 0x8130 when it stops."""
    config = reference()
    first = config.nodes[0]
    second = dataclasses.replace(first, id=6, commands={"valve_current": 0.0})
    with bench(dataclasses.replace(config, nodes=(first, second))) as b:
        b.ticks(5)
        watch = bytes.fromhex("23161001") + struct.pack("<I", 5 << 16 | 300)
        b.tick(Frame(0x606, watch))
        assert not [f for f in b.ticks(1000) if f.can_id == 0x086]
        b.tick(Frame(0x605, bytes.fromhex("2b17100000000000")))
        (emergency,) = [f for f in b.ticks(500) if f.can_id == 0x086]
        assert struct.unpack_from("<H", emergency.data)[0] == 0x8130


def test_stored_parameters_survive_a_restart(tmp_path: Path) -> None:
    """A heartbeat time saved by 0x1010 is used by the next rig, but not without storage."""
    config = reference()
    keeps = dataclasses.replace(config.nodes[0], storage=tmp_path / "parameters")
    keeping = dataclasses.replace(config, nodes=(keeps,))
    with bench(keeping) as b:
        b.ticks(5)
        b.ticks(2, Frame(0x605, bytes.fromhex("2b171000") + struct.pack("<I", 250)))
        b.ticks(2, Frame(0x605, bytes.fromhex("23101001") + b"save"))
    read = Frame(0x605, bytes.fromhex("4017100000000000"))
    for settings, expected in ((keeping, 250), (config, 100)):
        with bench(settings) as b:
            b.ticks(5)
            answers = [f for f in b.ticks(2, read) if f.can_id == 0x585]
            assert struct.unpack_from("<H", answers[0].data, 4)[0] == expected


def test_a_missing_eds_object_is_named(tmp_path: Path) -> None:
    """A node with the valve command but without its object is refused at the start."""
    config = reference()
    eds = config.nodes[0].eds.read_text()
    file = tmp_path / "other.eds"
    file.write_text(eds.replace("ParameterName=valve_current\n", "ParameterName=spool\n"))
    node = dataclasses.replace(config.nodes[0], eds=file, any_commands=False)
    with (
        pytest.raises(UserError, match="valve_current"),
        bench(dataclasses.replace(config, nodes=(node,))),
    ):
        pass
