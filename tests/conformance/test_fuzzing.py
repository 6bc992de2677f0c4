"""After random frames a device raises no error, uses no more memory, and conforms."""

import tracemalloc
from pathlib import Path

import pytest
from constant_node import READINGS, make_node, stepper
from fuzzing import Fuzzer, healing
from suite import inapplicable, own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus
from hil_emulator.device.measured import Measured
from hil_emulator.device.nmt import State
from hil_emulator.device.node import Node
from hil_emulator.platform.paths import shipped

NODE = 5
EDS_FILES = sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))
DEVICES = [
    pytest.param(
        eds, id=eds.stem, marks=[] if eds.stem == "hydraulic_actuator" else pytest.mark.slow
    )
    for eds in EDS_FILES
]
"""The combined device has the most objects."""
WARM_UP = 0.2
"""Share of the frames after which a device has allocated its memory: stored values, routes."""
MAY_GROW = 100_000
"""Bytes; a queue of 64 emergencies and a transfer under way are less. Assumed."""


def test_the_frames_reach_every_service() -> None:
    """20,000 frames bring a device through all states, all kinds of transfer and LSS."""
    node = make_node(shipped("eds/hydraulic_actuator.eds"), NODE)
    fuzzer = Fuzzer(301, node)
    measured = Measured(list(READINGS.values()), [0] * len(READINGS))
    states, answers, aborts = set(), set(), set()
    for tick in range(4_000):
        node.receive(tick * 1_000_000, fuzzer.batch())
        states.add(node.state)
        for can_id, data, _, _ in node.publish(tick * 1_000_000, measured):
            answers.add(can_id)
            if can_id == 0x580 + node.node_id:
                aborts.add(int.from_bytes(data[4:], "little") if data[0] == 0x80 else data[0])
    assert states == set(State)
    assert {0x080 + NODE, 0x180 + NODE, 0x580 + NODE, 0x700 + NODE, 0x7E4} <= answers
    assert {0x00, 0x41, 0x60, 0xA1, 0xA2, 0xA4, 0xC6} <= aborts
    assert {0x0503_0000, 0x0504_0001, 0x0504_0003, 0x0601_0002, 0x0609_0011} <= aborts


def fuzz(node: Node, seed: int, frames: int) -> tuple[int, int]:
    """Send random frames, then recover the device; return its time and growth in bytes."""
    fuzzer = Fuzzer(seed, node)
    measured = Measured(list(READINGS.values()), [0] * len(READINGS))
    now_ns = sent = base = 0
    tracemalloc.start()
    while sent < frames:
        batch = fuzzer.batch()
        sent += len(batch)
        now_ns += fuzzer.pause_ns()
        node.receive(now_ns, batch)
        for frame in node.publish(now_ns, measured):
            largest = 0x1FFF_FFFF if frame.extended else 0x7FF
            assert 0 < frame.can_id <= largest, f"seed {seed}, frame {sent}: {frame}"
            assert len(frame.data) <= 8, f"seed {seed}, frame {sent}: {frame}"
        if not base and sent > frames * WARM_UP:
            base = tracemalloc.get_traced_memory()[0]
    growth = tracemalloc.get_traced_memory()[0] - base
    tracemalloc.stop()
    for frame in healing(NODE):
        now_ns += 1_000_000
        node.receive(now_ns, [frame])
        node.publish(now_ns, measured)
    return now_ns, growth


def check(eds: Path, seed: int, frames: int) -> None:
    """Check that a device survives random frames unchanged."""
    node = make_node(eds, NODE)
    print(f"seed {seed}, {frames} frames")
    now_ns, growth = fuzz(node, seed, frames)
    assert node.node_id == NODE
    assert growth < MAY_GROW, f"seed {seed}: {growth} bytes more than after the warm-up"
    settings = own_channel()
    with Bus(settings) as port, Bus(settings) as peer:
        step = stepper(node, port, begin_ns=now_ns + 1_000_000)
        results = run_in_lock_step(peer, step, NODE, eds)
    results.check(skipped=inapplicable(eds, NODE))


@pytest.mark.parametrize("eds", DEVICES)
def test_five_thousand_frames(eds: Path) -> None:
    """Each shipped device conforms after random frames, 25,000 in total."""
    check(eds, seed=301, frames=5_000)


@pytest.mark.full(sibling="test_five_thousand_frames")
@pytest.mark.parametrize("eds", EDS_FILES, ids=lambda path: path.stem)
def test_two_hundred_thousand_frames(eds: Path) -> None:
    """Each shipped device conforms after random frames, 1,000,000 in total."""
    check(eds, seed=302, frames=200_000)
