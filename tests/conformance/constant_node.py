"""A device without hydraulics: a node with constant sensor readings, on any bus.

    python constant_node.py interface channel node-ID eds-file

It starts in 1 s, while the model takes a minute in the virtual machine of tests/vcan.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from hil_emulator.bus.bus import Bus
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

READINGS = {
    "pressure_a": 10.0e6,
    "pressure_b": 2.0e6,
    "supply_pressure": 16.0e6,
    "position": 0.1,
    "load_force": 500.0,
}
"""SI."""
TICK_NS = 1_000_000


class CanPort(Protocol):
    """The bus of the device."""

    def receive(self) -> list[Frame]:
        """Return the frames received."""
        ...

    def send(self, frames: list[Frame]) -> None:
        """Send frames."""
        ...


def make_node(eds: Path, node_id: int) -> Node:
    """Return a device; it commands a valve if its EDS has the object for it."""
    dictionary = Dictionary.from_eds(eds, node_id)
    commanding = dictionary.named("valve_current") is not None
    return Node(dictionary, list(READINGS), {"valve_current": 0.0} if commanding else {})


def stepper(node: Node, port: CanPort, begin_ns: int = 0) -> Callable[[], None]:
    """Return a function that executes one tick of a node on a bus."""
    now_ns = begin_ns

    def step() -> None:
        nonlocal now_ns
        node.receive(now_ns, port.receive())
        port.send(node.publish(now_ns, Measured(list(READINGS.values()), [0] * len(READINGS))))
        now_ns += TICK_NS

    return step


def main() -> None:
    """Serve until the process is ended."""
    interface, channel, node_id, eds = sys.argv[1:]
    node = make_node(Path(eds), int(node_id))
    measured = Measured(list(READINGS.values()), [0] * len(READINGS))
    with Bus({"interface": interface, "channel": channel}) as bus:
        print("ready", flush=True)
        while True:
            bus.wait(TICK_NS * 1e-9)
            now_ns = time.monotonic_ns()
            node.receive(now_ns, bus.receive())
            bus.send(node.publish(now_ns, measured))


if __name__ == "__main__":
    main()
