"""Error frames and bus-off: what they cost, and that others on the bus see them."""

from pathlib import Path

import can
import pytest
from rigs import START, reference, timed

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError
from hil_emulator.frame import BUS_ERROR, BUS_OFF, NO_ACKNOWLEDGE, RESTARTED, Frame
from hil_emulator.simulation.emulator import Emulator

EMCY = 0x085
RECOVERED = 0x8140


def codes(emulator: Emulator) -> list[int]:
    """Return the emergency codes that have left the node."""
    frames = emulator.recorder.frames
    sent = [f.data for _, sent, f in frames if sent and f.can_id == EMCY]
    return [int.from_bytes(data[:2], "little") for data in sent]


def test_error_frames_cost_time_and_are_seen_outside(tmp_path: Path) -> None:
    """A tenth of the frames destroyed: they come again; each error frame shows to others."""
    with Emulator(timed(tmp_path)) as emulator, can.Bus(**emulator.bus) as peer:  # type: ignore[arg-type]
        emulator.tick()
        peer.send(can.Message(arbitration_id=0, data=b"\x01\x05", is_extended_id=False))
        with emulator.fault("bus", "error_frames", probability=0.1):
            emulator.run_for("100 ms")
        heard = list(iter(lambda: peer.recv(0), None))
        errors = [m for m in heard if m.is_error_frame]
        assert {m.arbitration_id for m in errors} == {BUS_ERROR}
        assert len(errors) > 20
        counts = [m.data for m in heard if m.arbitration_id == 0x185 and not m.is_error_frame]
        assert len(counts) > 95


def test_a_cable_that_destroys_everything_is_bus_off(tmp_path: Path) -> None:
    """After 32 error frames the node is off the bus; back on it, it reports EMCY 0x8140."""
    with Emulator(timed(tmp_path)) as emulator, can.Bus(**emulator.bus) as peer:  # type: ignore[arg-type]
        emulator.tick()
        with emulator.fault("node5", "error_frames", probability=1.0, duration="8 ms"):
            emulator.run_for("60 ms")
        errors = [m.arbitration_id for m in iter(lambda: peer.recv(0), None) if m.is_error_frame]
        assert errors.count(BUS_ERROR) >= 32
        assert errors[32:34] == [BUS_OFF, RESTARTED]
        assert codes(emulator)[:2] == [RECOVERED, 0]


@pytest.mark.parametrize(("behaviour", "state"), [(0, 127), (1, 5), (2, 4)])
def test_bus_off_obeys_the_error_behaviour(tmp_path: Path, behaviour: int, state: int) -> None:
    """0x1029:1 determines the state of the node after bus-off, for any kind of bus."""
    for config in (reference(), timed(tmp_path)):
        with Emulator(config) as emulator:
            emulator.tick()
            (node,) = emulator.rig.nodes
            with Bus(emulator.bus) as peer:
                peer.send([Frame(0x605, bytes([0x2F, 0x29, 0x10, 1, behaviour, 0, 0, 0])), START])
                emulator.run_for("5 ms")
            assert node.state == 5
            kind = "bus_off" if emulator.rig.wire is None else "error_frames"
            odds = {"probability": 1.0} if emulator.rig.wire else {}
            with emulator.fault("node5", kind, duration="50 ms", **odds):
                emulator.run_for("50 ms")
            emulator.run_for("150 ms")
            assert node.state == state
            heartbeats = [
                f for _, sent, f in emulator.recorder.frames if sent and f.can_id == 0x705
            ]
            assert heartbeats[-1].data == bytes([state])
            assert (RECOVERED in codes(emulator)) == (state != 4)  # no EMCY in STOPPED


def test_a_node_that_is_not_acknowledged_becomes_error_passive(tmp_path: Path) -> None:
    """It repeats its frame, and reports EMCY 0x8120 as soon as others are there again."""
    with Emulator(timed(tmp_path)) as emulator, can.Bus(**emulator.bus) as peer:  # type: ignore[arg-type]
        emulator.tick()
        peer.send(can.Message(arbitration_id=0, data=b"\x01\x05", is_extended_id=False))
        emulator.run_for("5 ms")
        with emulator.fault("node", "no_acknowledge", duration="50 ms"):
            emulator.run_for("50 ms")
            assert codes(emulator) == []
        errors = [m.arbitration_id for m in iter(lambda: peer.recv(0), None) if m.is_error_frame]
        assert set(errors) == {NO_ACKNOWLEDGE}
        emulator.run_for("300 ms")
        assert codes(emulator) == [0x8120, 0]


def test_bus_off_shows_on_a_bus_that_takes_no_time_too() -> None:
    """The fault's beginning and end are error frames to the others."""
    with Emulator(reference()) as emulator, can.Bus(**emulator.bus) as peer:  # type: ignore[arg-type]
        with emulator.fault("node5", "bus_off"):
            emulator.run_for("5 ms")
        emulator.run_for("1 ms")
        errors = [m.arbitration_id for m in iter(lambda: peer.recv(0), None) if m.is_error_frame]
        assert errors == [BUS_OFF, RESTARTED]
        with pytest.raises(UserError, match="this bus takes no time"):
            emulator.fault("bus", "error_frames")
