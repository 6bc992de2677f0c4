"""A rig on a bus with modelled timing: order, queues, load, errors, independence of the clock."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from foreign_nodes import plant
from rigs import START, bench, reference, set_point, timed

from hil_emulator.bus.bus import Bus
from hil_emulator.can_timing.frame_length import length
from hil_emulator.commands.replay import compare
from hil_emulator.config.bus import WireSettings
from hil_emulator.config.load import load
from hil_emulator.device.bus_load import frame_bits
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import Clock, FollowSync, LockStep, WallClock
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.simulation.loop import Timing, run

MS = 1_000_000
EMCY = 0x085
CAN_OVERRUN = 0x8110


def codes(emulator: Emulator) -> list[int]:
    """Return the emergency codes that the node has sent."""
    frames = emulator.recorder.frames
    sent = [f.data for _, sent, f in frames if sent and f.can_id == EMCY]
    return [int.from_bytes(data[:2], "little") for data in sent]


def test_frames_leave_one_after_the_other_by_priority(tmp_path: Path) -> None:
    """A tick's TPDOs are sent in the order of identifiers, one after the other."""
    with Emulator(timed(tmp_path)) as emulator:
        emulator.rig.bus.send([])  # nothing leaves by itself
        emulator.tick()
        with Bus(emulator.bus) as peer:
            peer.send([START])
            emulator.run_for("20 ms")
            heard = [frame for _ in range(3) for frame in peer.receive()]
        sent = [(at, f) for at, sent, f in emulator.recorder.frames if sent and f.can_id != 0x705]
    assert [f for _, f in sent] == [f for f in heard if f.can_id != 0x705]
    assert [f.can_id for _, f in sent[:6]] == [0x185, 0x285, 0x385] * 2
    for (before, _), (after, frame) in itertools.pairwise(sent):
        assert after - before >= (3 + length(frame)) * 2000
    ends = [at % MS for at, _ in sent[:3]]
    assert ends[0] == length(sent[0][1]) * 2000
    assert ends[1] - ends[0] == (3 + length(sent[1][1])) * 2000


def test_a_controller_waits_for_the_wire(tmp_path: Path) -> None:
    """A request is received a tick after its arrival, and its answer is outside a tick later."""
    with plant(tmp_path, '[bus]\nbit_rate = "500 kbit/s"\ntiming = "modelled"\n') as rig:
        rig.emulator.run_for("5 ms")
        node = rig.master(5)
        begin = rig.emulator.rig.now_ns
        assert node.sdo[0x1000].raw == 0x198
        assert rig.emulator.rig.now_ns - begin == 3 * MS


def test_the_load_is_shown_and_recorded(tmp_path: Path) -> None:
    """The load is within the bounds of bit stuffing, and recorded as an event each second."""
    with Emulator(timed(tmp_path)) as emulator:
        emulator.tick()
        with Bus(emulator.bus) as peer:
            peer.send([START])
            emulator.run_for("3 s")
            frames = [f for at, sent, f in emulator.recorder.frames if sent and at >= 2000 * MS]
            events = [w["bus_load"] for _, w in emulator.recorder.events if "bus_load" in w]
        wire = emulator.rig.wire
    assert wire is not None
    exact = sum(length(f) + 3 for f in frames) / 500e3
    worst = sum(frame_bits(len(f.data)) for f in frames) / 500e3
    assert wire.load == pytest.approx(exact, rel=2e-3)
    assert events[-1] == wire.load <= worst < 1.2 * exact
    assert len(events) == 3


def test_a_node_loses_frames_on_an_overloaded_bus(tmp_path: Path) -> None:
    """At 125 kbit/s three PDOs per millisecond overrun the queue: EMCY 0x8110 until it is empty."""
    config = timed(tmp_path, bit_rate="125 kbit/s", transmit_queue=4)
    with Emulator(config) as emulator:
        emulator.tick()
        with Bus(emulator.bus) as peer:
            peer.send([START])
            emulator.run_for("100 ms")
            assert codes(emulator) == [CAN_OVERRUN]
            assert emulator.rig.wire is not None
            peer.send([Frame(0x000, b"\x80\x05")])
            emulator.run_for("20 ms")
        assert codes(emulator) == [CAN_OVERRUN, 0]
        sent = [f.can_id for _, sent, f in emulator.recorder.frames if sent]
        assert sent.count(0x385) < sent.count(0x185) / 5  # the lowest priority hardly gets through


@pytest.mark.parametrize(
    "clock_of",
    [
        pytest.param(lambda bus: WallClock(MS), id="wall", marks=pytest.mark.slow),
        pytest.param(lambda bus: FollowSync(bus, MS), id="follow-sync"),
    ],
)
def test_the_same_frames_in_give_the_same_frames_out(tmp_path: Path, clock_of: Any) -> None:
    """With each clock times and frames are those of a lock-step run."""
    config = timed(tmp_path)
    settings = {"interface": "virtual", "channel": f"timed {tmp_path}"}
    digests = []
    for make in (clock_of, lambda bus: LockStep()):
        with Bus(settings) as port, Bus(settings) as peer:
            clock: Clock = make(port)
            follow = clock if isinstance(clock, FollowSync) else None
            recorder = MemoryRecorder()
            rig = assemble(config, follow or port, cache_folder(), recorder)
            if follow:
                follow.serve = rig.serve
            for tick in range(50):
                frames = [START] if tick == 3 else [set_point(2.0)] if tick > 3 else []
                peer.send([Frame(0x080), *frames])
                run(rig, clock, 1, Timing())
            digests.append([(at, s, f) for at, s, f in recorder.frames if at > 0])
    assert digests[0] == digests[1]
    assert len(digests[0]) > 200


def test_a_recording_repeats(tmp_path: Path) -> None:
    """A run on a bus with modelled timing is replayed bit by bit, with the events of the load."""
    config = timed(tmp_path)
    with bench(config) as rig:
        rig.tick()
        rig.tick(START)
        for n in range(1200):
            rig.tick(*([set_point(n % 5)] if n % 7 == 0 else []))
        recording = remembered(rig.recorder, header(config, rig.rig.nodes))
    assert any("bus_load" in what for _, what in recording.events)
    assert compare(recording, config).same


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"timing": "modelled"}, "needs bit_rate"),
        ({"bit_rate": "500 kbit/s", "bitrate": 250000}, "a bus has one"),
        ({"timing": "exact"}, "'ideal' or 'modelled'"),
        ({"bit_rate": "5 Mbit/s"}, "outside the allowed"),
        ({"transmit_queue": 0}, "greater than or equal to 1"),
    ],
)
def test_a_mistake_is_reported(tmp_path: Path, settings: dict[str, Any], message: str) -> None:
    """A wrong `[bus]` table is refused with its place."""
    layer = tmp_path / "wrong.toml"
    layer.write_text("[bus]\n" + "".join(f"{k} = {v!r}\n" for k, v in settings.items()))
    with pytest.raises(UserError) as refusal:
        load([shipped("configs/hyq_knee.toml"), layer])
    assert message in str(refusal.value)


def test_it_is_off_by_default() -> None:
    """By default frames take no time on the bus."""
    assert reference().wire == WireSettings()
    with bench(reference()) as rig:
        assert rig.rig.wire is None
