"""The virtual bus of one process is compatible with python-can's virtual bus."""

from collections.abc import Iterator

import can
import pytest

from hil_emulator.bus.bus import RECEIVE_LIMIT, Bus
from hil_emulator.bus.opening import open_can_bus
from hil_emulator.frame import Burst, Frame

SETTINGS = {"interface": "virtual", "channel": "in process"}
FRAMES = [Frame(0x185, b"\x01\x02"), Frame(0x705, remote=True), Frame(0x1ABCDE, b"", False, True)]


@pytest.fixture
def door() -> Iterator[Bus]:
    """Yield the emulator's side of the bus."""
    with Bus(SETTINGS) as bus:
        yield bus


def stock() -> can.BusABC:
    """Join with python-can's virtual bus."""
    return can.Bus(**SETTINGS, ignore_config=True)


def test_frames_are_passed_without_a_copy(door: Bus) -> None:
    """Frames are immutable, so they are passed as they are; a sender does not receive its own."""
    with Bus(SETTINGS) as peer:
        door.send(FRAMES)
        heard = peer.receive()
        assert all(a is b for a, b in zip(heard, FRAMES, strict=True))
        assert door.receive() == []
        assert (door.sent, peer.received) == (3, 3)


def test_python_cans_bus_receives_equal_messages(door: Bus) -> None:
    """A message from this bus and one from python-can's bus differ only in time."""
    with stock() as listener, stock() as speaker:
        for frame in FRAMES:
            can_id, data, remote, extended = frame
            door.send([frame])
            speaker.send(can.Message(0, can_id, extended, remote, data=data))
            one, other = listener.recv(0), listener.recv(0)
            assert one is not None
            assert other is not None
            assert one.equals(other, timestamp_delta=None)
            assert one.timestamp == pytest.approx(other.timestamp, abs=60.0)
        assert door.receive() == FRAMES


def burst(count: int) -> Burst:
    """Return unread frames."""
    heads = [(0x180 + i % 8, False) for i in range(count)]
    return Burst(heads, lambda data: [data[i : i + 1] for i in range(count)], bytes(range(count)))


def test_unread_frames_arrive_as_others(door: Bus) -> None:
    """On this bus, as messages, on python-can's bus, with a filter, and in limited portions."""
    frames = list(burst(200))
    assert frames[3] == burst(200)[3] == Frame(0x183, b"\x03")
    with Bus(SETTINGS) as peer, open_can_bus(SETTINGS) as bus, stock() as other:
        bus.set_filters([{"can_id": 0x183, "can_mask": 0x7FF, "extended": False}])
        door.send([Frame(0x001)])
        door.send(burst(200))
        heard = [peer.receive(), peer.receive(), peer.receive()]
        assert [len(part) for part in heard] == [RECEIVE_LIMIT, 201 - RECEIVE_LIMIT, 0]
        assert heard[0] + heard[1] == [Frame(0x001), *frames]
        messages = [m for m in (bus.recv(0) for _ in range(201)) if m is not None]
        assert [bytes(m.data) for m in messages] == [f.data for f in frames if f.can_id == 0x183]
        assert len(list(iter(lambda: other.recv(0), None))) == door.sent == peer.received == 201


def test_it_is_a_bus_of_python_can(door: Bus) -> None:
    """The bus of `can_bus` sends, receives, filters and notifies like any bus of python-can."""
    with open_can_bus(SETTINGS) as bus, stock() as third:
        bus.send(can.Message(arbitration_id=0x600, data=b"\x40", is_extended_id=False))
        assert door.receive() == [Frame(0x600, b"\x40")]
        assert third.recv(0) is not None
        bus.set_filters([{"can_id": 0x185, "can_mask": 0x7FF, "extended": False}])
        door.send(FRAMES)
        heard = bus.recv(0)
        assert heard is not None
        assert (heard.arbitration_id, bytes(heard.data), heard.is_rx) == (0x185, b"\x01\x02", True)
        assert bus.recv(0) is None
    assert isinstance(bus, can.BusABC)


def test_a_closed_bus_refuses_frames(door: Bus) -> None:
    """A closed bus refuses frames, as python-can's bus does."""
    bus = open_can_bus(SETTINGS)
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.send(can.Message(arbitration_id=1))
