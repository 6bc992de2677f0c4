"""The actuator and ten foreign nodes on a timed bus of 500 kbit/s, with a stock master."""

import struct
from collections import Counter, defaultdict
from pathlib import Path

import canopen
import pytest
from ten_foreign_nodes import (
    ACTUATOR,
    BIT_RATE,
    NODES,
    SET_POINT_MS,
    SYNC_MS,
    bits,
    periods_ms,
    plant,
    set_up,
)

from hil_emulator.config.load import load
from hil_emulator.frame import Frame
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.testing.lockstep_network import LockStepNetwork


@pytest.mark.parametrize("seconds", [2, pytest.param(30, marks=pytest.mark.slow)])
def test_the_load_is_the_computed_one(tmp_path: Path, seconds: int) -> None:
    """Every message has its period, and the load is within 2 % of the computed load."""
    lines = ('bit_rate = "500 kbit/s"', 'timing = "modelled"')
    with Emulator(load(plant(tmp_path, *lines))) as emulator:
        network = LockStepNetwork(emulator)
        emulator.tick()
        masters = {n: network.add_node(n, canopen.ObjectDictionary()) for n in NODES}
        for node_id, index, subindex, size, value in set_up():
            masters[node_id].sdo.download(index, subindex, value.to_bytes(size, "little"))
        network.nmt.send_command(1)
        network.send_periodic(0x080, b"", SYNC_MS / 1e3)
        network.send_periodic(0x200 + ACTUATOR, struct.pack("<i", 1_000_000), SET_POINT_MS / 1e3)
        emulator.run_for("1 s")
        first = len(emulator.recorder.frames)
        emulator.run_for(float(seconds))
        frames = [f for _, _, f in emulator.recorder.frames[first:]]
        network.disconnect()
    counted = Counter(frame.can_id for frame in frames)
    assert set(counted) == set(periods_ms())
    for can_id, period_ms in periods_ms().items():
        assert counted[can_id] == pytest.approx(1000 * seconds / period_ms, abs=2), f"{can_id:X}"
    assert emulator.rig.wire is not None
    assert emulator.rig.wire.load == pytest.approx(computed_load(frames), rel=0.02)


def computed_load(frames: list[Frame]) -> float:
    """Return the load that follows from the periods and the mean lengths of the frames."""
    lengths = defaultdict(list)
    for frame in frames:
        lengths[frame.can_id].append(bits(frame.can_id, frame.data))
    mean = {can_id: sum(values) / len(values) for can_id, values in lengths.items()}
    return sum(mean[i] / (ms / 1e3) for i, ms in periods_ms().items()) / BIT_RATE
