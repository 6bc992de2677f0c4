"""What the nodes of a rig hear of each other and of the bus."""

import dataclasses
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest
from rigs import Bench, bench, reference

from hil_emulator.frame import Frame
from hil_emulator.simulation.frame_router import FrameRouter


@dataclass(eq=False)
class Listener:
    """A node as far as router goes."""

    hears: dict[int, bool]
    asked: frozenset[int] = frozenset()
    on_route: Callable[[], None] = field(default=lambda: None)


def heard(router: FrameRouter, *frames: Frame, everything: bool = False) -> list[list[int]]:
    """Return the COB-IDs that each node hears."""
    arriving = router.arriving(frames, everything=everything)
    return [[frame.can_id for frame in given] for _, given in arriving]


def test_what_no_node_takes_reaches_none() -> None:
    """A frame is passed on if any node takes it, from the bus or from another node."""
    a, b = Listener({0x080: False}), Listener({0x080: False, 0x181: False})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181), Frame(0x182)])  # type: ignore[arg-type]
    assert heard(router, Frame(0x080), Frame(0x300)) == [[0x080], [0x181, 0x080]]
    assert heard(router) == [[], []]


def test_a_remote_frame_is_for_who_sends_the_pdo() -> None:
    """It reaches the producer of the PDO, whose own data frames concern nobody."""
    a, b = Listener({}, frozenset({0x181})), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181, b"data")])  # type: ignore[arg-type]
    assert heard(router, Frame(0x181, remote=True)) == [[0x181], [0x181]]
    router.publish(a, [Frame(0x181, b"data")])  # type: ignore[arg-type]
    assert heard(router) == [[], []]


def test_a_frame_that_may_change_what_is_taken_lets_all_pass() -> None:
    """What follows a reconfiguration in the same tick may be meant by it."""
    router = FrameRouter([Listener({0x605: True})])  # type: ignore[list-item]
    assert heard(router, Frame(0x300), Frame(0x605), Frame(0x301)) == [[0x300, 0x605, 0x301]]


def test_faults_meet_every_frame() -> None:
    """On demand nothing is sorted out, but what a node said itself it never hears."""
    a, b = Listener({}), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181)])  # type: ignore[arg-type]
    assert heard(router, Frame(0x300), everything=True) == [[0x300], [0x181, 0x300]]


def test_a_changed_route_is_heeded() -> None:
    """A node that comes to take other frames says so."""
    a, b = Listener({0x200: False}), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    assert heard(router, Frame(0x201)) == [[], []]
    a.hears = {0x201: False}
    a.on_route()
    assert heard(router, Frame(0x201)) == [[0x201], [0x201]]


def test_a_node_alone_sorts_out_for_itself() -> None:
    """It is handed all that the bus carried, and nothing that it has said itself."""
    a = Listener({0x200: False})
    router = FrameRouter([a])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181)])  # type: ignore[arg-type]
    assert heard(router, Frame(0x201), Frame(0x200)) == [[0x201, 0x200]]
    assert heard(router, everything=True) == [[]]


@pytest.fixture
def b() -> Iterator[Bench]:
    """Yield a rig of two nodes, 5 and 6, both OPERATIONAL."""
    config = reference()
    first = config.nodes[0]
    second = dataclasses.replace(first, id=6, commands={})
    with bench(dataclasses.replace(config, nodes=(first, second))) as made:
        made.ticks(5)
        made.tick(Frame(0x000, bytes([1, 0])))
        yield made


def move_rpdo(node: int, can_id: int) -> list[Frame]:
    """Return the SDO requests that give RPDO1 another COB-ID."""
    head = bytes.fromhex("23001401")
    return [Frame(0x600 + node, head + struct.pack("<I", i)) for i in (1 << 31, can_id)]


def test_a_moved_rpdo_is_taken_in_the_tick_of_the_move(b: Bench) -> None:
    """The set point behind the SDO requests, under the new COB-ID, is in force at once."""
    b.tick(Frame(0x321, struct.pack("<i", 1_000_000)))
    assert b.rig.plant.inputs.valve_current == 0.0
    b.tick(*move_rpdo(5, 0x321), Frame(0x321, struct.pack("<i", 1_000_000)))
    assert b.rig.plant.inputs.valve_current == pytest.approx(1e-3)


def test_a_node_takes_the_pdo_of_another(b: Bench) -> None:
    """Node 5 takes the position in TPDO2 of node 6 for its set point, a tick after it was sent."""
    b.tick(*move_rpdo(5, 0x286))
    (sent,) = [f for f in b.tick() if f.can_id == 0x286]
    b.tick()
    (value,) = struct.unpack_from("<i", sent.data)
    assert value == pytest.approx(400_000, abs=10_000)
    assert b.rig.nodes[0].dictionary.named("valve_current").value == value  # type: ignore[union-attr]
