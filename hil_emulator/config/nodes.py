"""`[[node]]`: one CANopen node, with the EDS of any maker."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from hil_emulator.config.bus import BIT_RATE
from hil_emulator.config.course_points import column
from hil_emulator.config.object_map import COMMAND_UNITS, ObjectSettings, read_map
from hil_emulator.config.table import DescribedTable, QuantityReader
from hil_emulator.model.declare import Param

UNCONFIGURED = 0xFF
"""Node-ID of an unconfigured device (CiA 305)."""

SAFE_CURRENT = Param("safe_current", "A", "set point without a controller", 0.0, -10.0, 10.0, "mA")

_IDENTITY = {
    "vendor_id": (0x1018, 1),
    "product_code": (0x1018, 2),
    "revision_number": (0x1018, 3),
    "device_name": (0x1008, 0),
    "hardware_version": (0x1009, 0),
    "software_version": (0x100A, 0),
}
"""Index and sub-index by key (CiA 301 7.5.2)."""
_NODE_ID = Annotated[int, Field(ge=1, le=127)] | Literal["unconfigured"]
_U32 = Annotated[int | None, Field(ge=0, le=0xFFFF_FFFF)]


def read_id(word: object) -> int:
    """Return a node-ID, `UNCONFIGURED` for the word.

    Raises:
        ValueError: it is neither that word nor 1 to 127.

    """
    if word == "unconfigured":
        return UNCONFIGURED
    if isinstance(word, int) and 1 <= word <= 127:
        return int(word)
    raise ValueError(f'{word!r} is no node-ID: 1 to 127, or "unconfigured" to get one by LSS')


class IdentityTable(DescribedTable):
    """Identity objects whose values differ from those in the EDS."""

    vendor_id: _U32 = None
    """value of 0x1018:01"""
    product_code: _U32 = None
    """value of 0x1018:02"""
    revision_number: _U32 = None
    """value of 0x1018:03"""
    device_name: str | None = None
    """value of 0x1008"""
    hardware_version: str | None = None
    """value of 0x1009"""
    software_version: str | None = None
    """value of 0x100A"""


class NodeTable(DescribedTable):
    """One CANopen node: its IDs, EDS, commands, safe current, and folder of stored parameters."""

    id: Annotated[int, BeforeValidator(read_id, json_schema_input_type=_NODE_ID)]
    """node-ID, or `"unconfigured"` to get one by LSS"""
    serial_number: int | None = Field(default=None, ge=1, le=0xFFFF_FFFF)
    """value of 0x1018:04; without it every node has a different one"""
    eds: str
    """EDS or DCF of the node; the path is relative to this file"""
    commands: tuple[Literal["valve_current"], ...] | None = None
    """inputs of the plant that it commands; without it all that its map or EDS has"""
    storage: str | None = None
    """folder of the parameters that a master stores with 0x1010; without it they are lost"""
    safe_current: Annotated[float, QuantityReader(SAFE_CURRENT)] = SAFE_CURRENT.typical
    map: Annotated[
        tuple[ObjectSettings, ...] | None,
        BeforeValidator(read_map, json_schema_input_type=dict[str, Any]),
    ] = None
    """what its objects show and command, such as `{ "0x6130:1" = "pressure_a" }`"""
    identity: IdentityTable = IdentityTable()
    """identity objects whose values differ from those in the EDS"""
    autostart: bool | None = None
    """whether it enters OPERATIONAL by itself; without it 0x1F80 decides"""
    bit_rate: Annotated[float | None, QuantityReader(BIT_RATE)] = None
    extended_ids: bool = True
    """whether its PDOs may have 29-bit identifiers"""


@dataclass(frozen=True)
class NodeSettings:
    """One CANopen node.

    Attributes:
        id: its node-ID, `UNCONFIGURED` where LSS is to give it one.
        eds: path of its EDS.
        commands: what it commands, with the values in SI that hold without a controller; empty
            for a node that only measures.
        storage: folder in which it keeps parameters stored by 0x1010; None forgets them.
        serial_number: as configured; None leaves it to the EDS, or to node-ID and bus.
        bus_number: counts the buses of a machine.
        objects: what its objects show and command; None leaves it to names in the EDS.
        identity: other values of 0x1018 and 0x1008 to 0x100A, by (index, sub-index).
        autostart: whether it enters OPERATIONAL by itself; None leaves it to 0x1F80.
        bit_rate: what its bus must have [bit/s]; None for any.
        extended_ids: whether its PDOs may have 29-bit identifiers.
        any_commands: whether `commands` are only those that count if its EDS has an object for
            them.

    """

    id: int
    eds: Path
    commands: dict[str, float]
    storage: Path | None = None
    serial_number: int | None = None
    bus_number: int = 0
    objects: tuple[ObjectSettings, ...] | None = None
    identity: dict[tuple[int, int], int | str] = field(default_factory=dict)
    autostart: bool | None = None
    bit_rate: float | None = None
    extended_ids: bool = True
    any_commands: bool = False


def node_settings(table: NodeTable, folder: Path) -> NodeSettings:
    """Return the settings of a table.

    Args:
        table: as it was read.
        folder: that of its file, where the paths in it begin.

    Raises:
        UserError: a CSV file that it names cannot be used.

    """
    return NodeSettings(
        table.id,
        folder / table.eds,
        dict.fromkeys(_commands(table), table.safe_current),
        None if table.storage is None else folder / table.storage,
        table.serial_number,
        objects=None if table.map is None else tuple(_with_points(o, folder) for o in table.map),
        identity=_identity(table.identity),
        autostart=table.autostart,
        bit_rate=table.bit_rate,
        extended_ids=table.extended_ids,
        any_commands=table.commands is None,
    )


def _commands(table: NodeTable) -> Sequence[str]:
    """Return the commands that a table names, else all that the map has, else all there are."""
    if table.commands is not None:
        return table.commands
    named = COMMAND_UNITS if table.map is None else [o.signal for o in table.map]
    return [name for name in COMMAND_UNITS if name in named]


def _with_points(settings: ObjectSettings, folder: Path) -> ObjectSettings:
    if settings.column is None:
        return settings
    file, name = settings.column
    return dataclasses.replace(settings, points=column(folder / file, name))


def _identity(table: IdentityTable) -> dict[tuple[int, int], int | str]:
    given = {place: getattr(table, name) for name, place in _IDENTITY.items()}
    return {place: value for place, value in given.items() if value is not None}
