"""A plant with one actuator and ten foreign nodes: their types, set-up and messages.

Nodes 10 to 13 are pressure transmitters, 14 to 17 encoders, 18 and 19 valves without commands.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from hil_emulator.platform.paths import shipped

ACTUATOR = 5
TRANSMITTERS, ENCODERS, VALVES = range(10, 14), range(14, 18), range(18, 20)
NODES = (ACTUATOR, *TRANSMITTERS, *ENCODERS, *VALVES)
BIT_RATE = 500_000
SYNC_MS = SET_POINT_MS = 10
HEARTBEAT_MS = 100

CHANNELS = ("pressure_a", "pressure_b", "supply_pressure", "pressure_a")
"""What the transmitters show."""
_FOREIGN = shipped("configs/foreign_plant.toml").parent / "foreign"


def eds_of(node_id: int) -> Path:
    """Return a node's EDS."""
    if node_id == ACTUATOR:
        return shipped("eds/hydraulic_actuator.eds")
    kind = "transmitter" if node_id in TRANSMITTERS else "encoder"
    return _FOREIGN / f"{'valve' if node_id in VALVES else kind}.eds"


class Write(NamedTuple):
    """An expedited SDO download."""

    node_id: int
    index: int
    subindex: int
    size: int
    value: int


def plant(folder: Path, *lines: str) -> list[Path]:
    """Return the configuration files of the plant.

    Args:
        folder: where to put what is not shipped.
        *lines: of `[bus]`.

    """
    text = ["[bus]", *lines, "[[node]]", f"id = {ACTUATOR}"]
    text.append(f'eds = "{eds_of(ACTUATOR)}"')
    for node_id in NODES[1:]:
        text += ["[[node]]", f"id = {node_id}", f'eds = "{eds_of(node_id)}"', "commands = []"]
        if node_id in TRANSMITTERS:
            channel = CHANNELS[node_id - TRANSMITTERS[0]]
            text.append(f'map = {{ "0x6100:1" = {{ channel = "{channel}", unit = "1 bar" }} }}')
        if node_id in ENCODERS:
            text.append('map = { "0x6004" = "position" }')
    layer = folder / "ten_foreign_nodes.toml"
    layer.write_text("\n".join(text) + "\n")
    return [shipped("configs/hyq_knee.toml"), layer]


def set_up(stretch: int = 1) -> Iterator[Write]:
    """Yield what a master writes before it starts the nodes; `stretch` makes all periods longer."""
    for node_id in NODES:
        yield Write(node_id, 0x1017, 0, 2, HEARTBEAT_MS * stretch)
    yield Write(ACTUATOR, 0x1400, 5, 2, 0)  # no deadline: an emulated processor may be late
    for number, period_ms in enumerate((10, 20, 50)):
        yield Write(ACTUATOR, 0x1800 + number, 5, 2, period_ms * stretch)
    for node_id in TRANSMITTERS:
        yield Write(node_id, 0x1A00, 1, 4, 0x7130_0110)
        yield Write(node_id, 0x1A00, 2, 4, 0x6150_0108)
        yield Write(node_id, 0x1A00, 0, 1, 2)
        yield Write(node_id, 0x6132, 1, 1, 2)
        yield Write(node_id, 0x1800, 5, 2, 10 * stretch)
        yield Write(node_id, 0x1800, 1, 4, 0x4000_0180 + node_id)
    for node_id in ENCODERS:
        yield Write(node_id, 0x6200, 0, 2, 20 * stretch)
    for node_id in VALVES:
        yield Write(node_id, 0x1800, 5, 2, 100 * stretch)


def periods_ms(stretch: int = 1) -> dict[int, int]:
    """Return the configured period of every message on the bus, by its identifier."""
    periods = {0x080: SYNC_MS, 0x200 + ACTUATOR: SET_POINT_MS}
    periods |= {0x700 + node_id: HEARTBEAT_MS for node_id in NODES}
    periods |= {base + ACTUATOR: ms for base, ms in ((0x180, 10), (0x280, 20), (0x380, 50))}
    periods[0x480 + ACTUATOR] = SYNC_MS
    periods |= {0x180 + node_id: 10 for node_id in TRANSMITTERS}
    periods |= {0x180 + node_id: 20 for node_id in ENCODERS}
    periods |= {0x180 + node_id: 100 for node_id in VALVES}
    return {can_id: period_ms * stretch for can_id, period_ms in periods.items()}


def bits(can_id: int, data: bytes) -> int:
    """Return the bits of a base frame with its intermission, sent bit by bit (ISO 11898-1)."""
    head = f"0{can_id:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    register = 0
    for bit in head:
        register = (register << 1) ^ (0xC599 if (register >> 14 ^ int(bit)) & 1 else 0)
        register &= 0x7FFF
    sent = ""
    for bit in head + f"{register:015b}":
        sent += bit
        if sent[-5:] in ("00000", "11111"):
            sent += "1" if bit == "0" else "0"
    return len(sent) + 13
