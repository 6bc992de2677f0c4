"""Frames that the nodes of a rig receive from each other and from the bus."""

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
    """A node with the attributes that the router uses."""

    hears: dict[int, bool]
    asked: frozenset[int] = frozenset()
    on_route: Callable[[], None] = field(default=lambda: None)


def heard(router: FrameRouter, *frames: Frame, everything: bool = False) -> list[list[int]]:
    """Return the COB-IDs that each node receives."""
    arriving = router.arriving(frames, everything=everything)
    return [[frame.can_id for frame in given] for _, given in arriving]


def test_a_frame_that_no_node_accepts_is_dropped() -> None:
    """A frame from the bus or from another node is passed if any node accepts it."""
    a, b = Listener({0x080: False}), Listener({0x080: False, 0x181: False})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181), Frame(0x182)])  # type: ignore[arg-type]
    assert heard(router, Frame(0x080), Frame(0x300)) == [[0x080], [0x181, 0x080]]
    assert heard(router) == [[], []]


def test_a_remote_frame_reaches_the_producer_of_the_pdo() -> None:
    """A remote frame reaches the producer of the PDO; its data frames have no consumer."""
    a, b = Listener({}, frozenset({0x181})), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181, b"data")])  # type: ignore[arg-type]
    assert heard(router, Frame(0x181, remote=True)) == [[0x181], [0x181]]
    router.publish(a, [Frame(0x181, b"data")])  # type: ignore[arg-type]
    assert heard(router) == [[], []]


def test_a_frame_that_may_change_routes_disables_the_filter() -> None:
    """Frames after a reconfiguration in the same tick may have new identifiers."""
    router = FrameRouter([Listener({0x605: True})])  # type: ignore[list-item]
    assert heard(router, Frame(0x300), Frame(0x605), Frame(0x301)) == [[0x300, 0x605, 0x301]]


def test_faults_apply_to_every_frame() -> None:
    """With `everything` no frame is filtered, but a node never receives its own frames."""
    a, b = Listener({}), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    router.publish(a, [Frame(0x181)])  # type: ignore[arg-type]
    assert heard(router, Frame(0x300), everything=True) == [[0x300], [0x181, 0x300]]


def test_a_changed_route_is_applied() -> None:
    """A node notifies the router when it accepts other frames."""
    a, b = Listener({0x200: False}), Listener({})
    router = FrameRouter([a, b])  # type: ignore[list-item]
    assert heard(router, Frame(0x201)) == [[], []]
    a.hears = {0x201: False}
    a.on_route()
    assert heard(router, Frame(0x201)) == [[0x201], [0x201]]


def test_a_single_node_filters_by_itself() -> None:
    """It receives all frames of the bus, but not its own frames."""
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


def test_a_moved_rpdo_is_received_in_the_tick_of_the_move(b: Bench) -> None:
    """A set point with the new COB-ID after the SDO requests is in force at once."""
    b.tick(Frame(0x321, struct.pack("<i", 1_000_000)))
    assert b.rig.plant.inputs.valve_current == 0.0
    b.tick(*move_rpdo(5, 0x321), Frame(0x321, struct.pack("<i", 1_000_000)))
    assert b.rig.plant.inputs.valve_current == pytest.approx(1e-3)


def test_a_node_receives_the_pdo_of_another(b: Bench) -> None:
    """Node 5 receives TPDO2 of node 6 as its set point, a tick after it was sent."""
    b.tick(*move_rpdo(5, 0x286))
    (sent,) = [f for f in b.tick() if f.can_id == 0x286]
    b.tick()
    (value,) = struct.unpack_from("<i", sent.data)
    assert value == pytest.approx(400_000, abs=10_000)
    assert b.rig.nodes[0].dictionary.named("valve_current").value == value  # type: ignore[union-attr]
