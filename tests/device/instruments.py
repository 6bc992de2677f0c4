"""The instruments of the separate layout, each alone on a bus with a stock master."""

from pathlib import Path

from device_master import NODE_ID, Master
from simulated_network import SimulatedNetwork

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node

FOLDER = Path(__file__).parents[2] / "eds"
LAYOUT = ("valve_driver", "load_cell", "pressure_transmitter", "position_sensor")
CHANNELS = (
    "pressure_a",
    "pressure_b",
    "supply_pressure",
    "position",
    "load_force",
    "velocity",
    "spool_position",
)
READINGS = (100e5, 20e5, 160e5, 0.04, 500.0, 0.25, 0.0)
SAFE_CURRENT = 0.001
RATED_CURRENT = 0.010
FULL_SCALE = 16384


def instrument(name: str, channels: tuple[str, ...] = CHANNELS, eds: Path | None = None) -> Master:
    """Return a stock master on a bus with one instrument that has just booted."""
    path = eds or FOLDER / f"{name}.eds"
    commands = {"valve_current": SAFE_CURRENT} if name == "valve_driver" else {}
    node = Node(Dictionary.from_eds(path, NODE_ID), channels, commands)
    measured = Measured(list(READINGS[: len(channels)]), [0] * len(channels))
    master = Master(SimulatedNetwork(node, measured), path)
    master.run(1)
    return master


def show(master: Master, overrange: int = 0, **readings: float) -> None:
    """Set the readings of some channels in the next tick; others keep their readings."""
    values, ranges = list(READINGS), [0] * len(CHANNELS)
    for name, value in readings.items():
        values[CHANNELS.index(name)] = value
        ranges[CHANNELS.index(name)] = overrange
    master.measure(tuple(values), tuple(ranges))
    master.run(1)
