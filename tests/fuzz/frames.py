"""Invalid frames for every shipped device."""

import sys
import traceback
from pathlib import Path

from hil_emulator.device.measured import Measured
from hil_emulator.platform.paths import shipped

sys.path.append(str(Path(__file__).parents[1] / "conformance"))

from constant_node import READINGS, make_node
from fuzzing import Fuzzer, healing

NODE = 5


def attack(count: int, seed: int) -> int:
    """Send a number of frames to the devices, in equal shares; return the number of failures."""
    sheets = sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))
    failed = 0
    for sheet in sheets:
        node = make_node(sheet, NODE)
        fuzzer = Fuzzer(seed, node)
        measured = Measured(list(READINGS.values()), [0] * len(READINGS))
        now_ns = sent = answered = 0
        while sent < count // len(sheets):
            batch = fuzzer.batch()
            sent += len(batch)
            now_ns += fuzzer.pause_ns()
            try:
                node.receive(now_ns, batch)
                answered += len(node.publish(now_ns, measured))
            except Exception:
                failed += 1
                traceback.print_exc()
        for frame in healing(NODE):
            now_ns += 1_000_000
            node.receive(now_ns, [frame])
            node.publish(now_ns, measured)
        assert node.node_id == NODE
        print(f"{sheet.stem}: {sent} frames, {answered} answers", flush=True)
    return failed
