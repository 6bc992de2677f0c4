"""`Bus` on python-can's virtual bus; test_contract.py has the tests of all buses."""

from collections.abc import Iterator

import can
import pytest

from hil_emulator.bus.bus import RECEIVE_LIMIT, Bus
from hil_emulator.frame import Frame


@pytest.fixture
def bus() -> Iterator[Bus]:
    """Yield a bus without other nodes."""
    with Bus({"interface": "virtual", "channel": "test_bus"}) as bus:
        yield bus


@pytest.fixture
def peer() -> Iterator[can.BusABC]:
    """Yield a stock python-can node on the same wire."""
    with can.Bus(interface="virtual", channel="test_bus") as peer:
        yield peer


def test_a_bus_without_other_nodes_is_silent(bus: Bus) -> None:
    """No frame arrives, no frame is lost, and sent frames are not received."""
    bus.send([Frame(0x701, b"\x00")])
    assert bus.receive() == []
    assert (bus.sent, bus.received, bus.dropped) == (1, 0, 0)


def test_one_receive_is_bounded_and_loses_nothing(bus: Bus, peer: can.BusABC) -> None:
    """Many frames are returned in portions, in order."""
    flood = 2 * RECEIVE_LIMIT + 1
    for number in range(flood):
        peer.send(can.Message(arbitration_id=number, is_extended_id=False))
    portions = [bus.receive() for _ in range(4)]
    assert [len(portion) for portion in portions] == [RECEIVE_LIMIT, RECEIVE_LIMIT, 1, 0]
    assert [frame.can_id for portion in portions for frame in portion] == list(range(flood))


def test_a_wait_takes_no_frame_away(bus: Bus, peer: can.BusABC) -> None:
    """The frame that ended a wait is first in the next receive, and counts once in the bound."""
    for number in range(RECEIVE_LIMIT + 1):
        peer.send(can.Message(arbitration_id=number, is_extended_id=False))
    assert bus.wait(5.0)
    assert bus.wait(5.0)
    assert [frame.can_id for frame in bus.receive()] == list(range(RECEIVE_LIMIT))
    assert bus.receive() == [Frame(RECEIVE_LIMIT)]
    assert bus.received == RECEIVE_LIMIT + 1


def test_errors_on_the_wire_are_counted_and_not_handed_on(bus: Bus, peer: can.BusABC) -> None:
    """Error frames and CAN FD frames, which are errors for a classical controller, are dropped."""
    peer.send(can.Message(is_error_frame=True))
    peer.send(can.Message(arbitration_id=1, is_fd=True, data=bytes(12)))
    peer.send(can.Message(arbitration_id=2, is_extended_id=False))
    assert bus.receive() == [Frame(2)]
    assert (bus.error_frames, bus.received) == (2, 1)


def test_an_error_frame_does_not_end_a_wait(bus: Bus, peer: can.BusABC) -> None:
    """Only a frame that can be received ends a wait."""
    peer.send(can.Message(is_error_frame=True))
    assert not bus.wait(0.0)
    peer.send(can.Message(is_error_frame=True))
    peer.send(can.Message(arbitration_id=2, is_extended_id=False))
    assert bus.wait(5.0)


def test_a_full_receiver_does_not_stop_the_sender(bus: Bus) -> None:
    """If a node's queue is full the frame is dropped and counted, and the next frame is tried."""
    with can.Bus(interface="virtual", channel="test_bus", rx_queue_size=1) as narrow:
        bus.send([Frame(1), Frame(2)])
        assert (bus.sent, bus.dropped) == (1, 1)
        assert narrow.recv(0) is not None
        bus.send([Frame(3)])
        assert (bus.sent, bus.dropped) == (2, 1)


def test_receivers_do_not_share_a_frame(bus: Bus, peer: can.BusABC) -> None:
    """A node that changes a received message does not change it for other nodes."""
    with can.Bus(interface="virtual", channel="test_bus") as third:
        bus.send([Frame(0x181, b"\x01\x02")])
        mine, other = peer.recv(5.0), third.recv(5.0)
        assert mine is not None
        assert other is not None
        mine.data[0] = 0xFF
        assert other.data == b"\x01\x02"
        assert isinstance(other.data, bytearray)


def test_a_remote_frame_keeps_its_length_code(bus: Bus, peer: can.BusABC) -> None:
    """It has no data and keeps its length code in both directions."""
    peer.send(can.Message(arbitration_id=0x185, is_remote_frame=True, dlc=6, is_extended_id=False))
    (frame,) = bus.receive()
    assert (frame.remote, len(frame.data)) == (True, 6)
    bus.send([frame])
    message = peer.recv(0)
    assert message is not None
    assert (message.is_remote_frame, message.dlc, len(message.data)) == (True, 6, 0)
