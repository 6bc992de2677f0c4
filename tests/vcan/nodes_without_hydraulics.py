"""The nodes of `ten_foreign_nodes` on kernel CAN, with readings of their own instead of a plant.

    python nodes_without_hydraulics.py channel

They start in seconds where the model needs minutes, as in the virtual machine.
"""

import math
import sys
import time

from ten_foreign_nodes import ACTUATOR, CHANNELS, ENCODERS, NODES, TRANSMITTERS, eds_of

from hil_emulator.bus.bus import Bus
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.device.scale import Scale

READINGS = {
    "pressure_a": 10.0e6,
    "pressure_b": 2.0e6,
    "supply_pressure": 16.0e6,
    "position": 0.1,
    "load_force": 500.0,
}
"""SI; each swings by a tenth."""
TICK_S = 0.01
PASCAL_PER_BAR = 1e5


def make(node_id: int) -> Node:
    """Return a node that shows its channel, as the configuration's `map` would have it."""
    dictionary = Dictionary.from_eds(eds_of(node_id), node_id)
    if node_id in TRANSMITTERS:
        channel = CHANNELS[node_id - TRANSMITTERS[0]]
        dictionary.assign(dictionary.entry(0x6100, 1), channel, Scale("Pa", PASCAL_PER_BAR))
    if node_id in ENCODERS:
        dictionary.assign(dictionary.entry(0x6004), "position", None)
    return Node(dictionary, list(READINGS), {"valve_current": 0.0} if node_id == ACTUATOR else {})


def main() -> None:
    """Serve until the process is ended."""
    nodes = [make(node_id) for node_id in NODES]
    begin = due = time.monotonic()
    with Bus({"interface": "socketcan", "channel": sys.argv[1]}) as bus:
        print("ready", flush=True)
        while True:
            due += TICK_S
            time.sleep(max(0.0, due - time.monotonic()))
            now_ns = time.monotonic_ns()
            swing = 1.0 + 0.1 * math.sin(time.monotonic() - begin)
            measured = Measured([v * swing for v in READINGS.values()], [0] * len(READINGS))
            frames = bus.receive()
            for node in nodes:
                node.receive(now_ns, frames)
                bus.send(node.publish(now_ns, measured))


if __name__ == "__main__":
    main()
