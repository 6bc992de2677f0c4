"""The node continues to work after any frames."""

import random

from device_master import CHANNELS, EDS, HEARTBEAT, NODE_ID, READINGS, SDO_ANSWER, SDO_REQUEST
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.nmt import State
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

MEASURED = Measured(list(READINGS), [0] * len(CHANNELS))
READ_DEVICE_TYPE = Frame(SDO_REQUEST, bytes.fromhex("4000100000000000"))
RESET = Frame(0x000, bytes([129, 0]))

service_ids = st.sampled_from([0, 0x80, 0x85, 0x185, 0x205, 0x485, 0x605, 0x705, 0x7E5])
frames = st.builds(
    Frame,
    can_id=service_ids | st.integers(0, 0x1FFFFFFF),
    data=st.binary(max_size=8),
    remote=st.booleans(),
    extended=st.booleans(),
)


def new_node() -> Node:
    """Return a device that has booted."""
    dictionary = Dictionary.from_eds(EDS, NODE_ID)
    node = Node(dictionary, CHANNELS, {"valve_current": 0.0})
    node.publish(0, MEASURED)
    return node


def answers_sdo(node: Node, now_ns: int) -> bool:
    """Return whether a reset node boots and answers a read of its device type."""
    node.receive(now_ns, [RESET])
    assert [f.can_id for f in node.publish(now_ns, MEASURED)] == [HEARTBEAT]
    node.receive(now_ns + 1, [READ_DEVICE_TYPE])
    answers = node.publish(now_ns + 1, MEASURED)
    return Frame(SDO_ANSWER, bytes.fromhex("4300100098010000")) in answers


def random_frame(rng: random.Random) -> Frame:
    """Return a random frame; half of the frames have an identifier that the node accepts."""
    listened = (0x000, 0x080, 0x185, 0x205, 0x485, SDO_REQUEST)
    can_id = rng.choice(listened) if rng.random() < 0.5 else rng.getrandbits(11)
    data = rng.randbytes(8 if rng.random() < 0.6 else rng.randrange(9))
    if can_id == SDO_REQUEST and rng.random() < 0.5:
        index = rng.choice((0x1003, 0x1005, 0x1014, 0x1017, 0x1400, 0x1600, 0x1800, 0x1A00, 0x2000))
        head = bytes([rng.choice((0x23, 0x2B, 0x2F, 0x40, 0x21))])
        data = head + index.to_bytes(2, "little") + bytes([rng.randrange(9)]) + data[4:]
    return Frame(can_id, data, rng.random() < 0.1, rng.random() < 0.1)


def test_hundred_thousand_random_frames() -> None:
    """After 100,000 random frames, SDO writes among them, the node still answers an SDO."""
    states = set()
    rng = random.Random(301)
    node = new_node()
    for tick in range(1, 10_001):
        command = bytes([rng.choice((1, 1, 1, 2, 128, 129, 130)), 0])
        batch = [random_frame(rng) for _ in range(10)]
        node.receive(tick * 1_000_000, [Frame(0, command), *batch] if tick % 20 == 0 else batch)
        states.add(node.state)
        node.publish(tick * 1_000_000, MEASURED)
    assert states == set(State)
    assert answers_sdo(node, 10_002 * 1_000_000)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.lists(frames, max_size=6), max_size=12))
def test_any_frames_in_any_ticks(ticks: list[list[Frame]]) -> None:
    """No sequence of frames raises an error, and every frame sent is valid."""
    node = new_node()
    for tick, batch in enumerate([[Frame(0, b"\x01\x00")], *ticks], start=1):
        commands = node.receive(tick * 1_000_000, batch)
        assert abs(commands["valve_current"]) <= 0.01 + 1e-12
        for frame in node.publish(tick * 1_000_000, MEASURED):
            assert 0 < frame.can_id <= 0x7FF
            assert len(frame.data) <= 8
    assert answers_sdo(node, 1_000_000_000)
