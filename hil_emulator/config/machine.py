"""A machine of several actuators: which files describe each, and which bus it is on.

[buses.left]
interface = "virtual"
channel = "left"

[supplies.pump]          # one pump, accumulator and pair of lines for all that name it
files = ["hyq_supply.toml"]      # laid over the files of each of them

[[actuator]]
name = "lf_knee"
files = ["hyq_knee.toml"]
bus = "left"
node_offset = 10        # added to every node-ID in its files
supply = "pump"         # without it, the one in its files is its own

An actuator with `carries = "lf_knee"` moves the link at whose end the knee's joint is.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from hil_emulator.config.actuators import ActuatorSettings
from hil_emulator.config.bus import BusTable, WireSettings, split
from hil_emulator.config.legs import with_legs
from hil_emulator.config.load import load_rig
from hil_emulator.config.mistakes import describe
from hil_emulator.config.nodes import UNCONFIGURED
from hil_emulator.config.one_supply import on_one_supply
from hil_emulator.config.table import DescribedTable
from hil_emulator.config.toml_file import read_toml
from hil_emulator.errors import UserError

ONLY_BUS = "bus"
"""Name of the bus of a configuration with one actuator."""


class ActuatorTable(DescribedTable):
    """One actuator: files, bus, supply, carried actuator, and offset of node-IDs."""

    name: str = Field(min_length=1)
    """name in recordings and faults"""
    files: tuple[str, ...] = Field(min_length=1)
    """its configuration, later files over earlier ones; paths are relative to this file"""
    bus: str
    """name of one of [buses]"""
    node_offset: int = Field(default=0, ge=0, le=126)
    """added to every node-ID in its files"""
    supply: str | None = None
    """name of one of [supplies]; without it the actuator has a supply of its own"""
    carries: str | None = None
    """name of the actuator whose joint is at the end of the link that this actuator moves"""


class SupplyTable(DescribedTable):
    """A supply that several actuators share."""

    files: tuple[str, ...] = Field(min_length=1)
    """configuration files, laid over those of each actuator on it; paths relative to this file"""


class MachineTable(DescribedTable):
    """A machine of several actuators, under one clock."""

    buses: dict[str, BusTable] = Field(min_length=1)
    """the buses by name, each like [bus] of a configuration"""
    supplies: dict[str, SupplyTable] = Field(default_factory=dict)
    """the supplies that several actuators share, by name"""
    actuator: tuple[ActuatorTable, ...] = Field(min_length=1)
    """the actuators"""


@dataclass(frozen=True)
class MachineSettings:
    """Several actuators under one loop.

    Attributes:
        actuators: at least one; all have the same tick.
        buses: arguments of `can.Bus` by name.
        wires: bit rate and timing of the buses, by name.

    """

    actuators: tuple[ActuatorSettings, ...]
    buses: Mapping[str, Mapping[str, Any]]
    wires: Mapping[str, WireSettings]


def load_machine(files: Sequence[Path]) -> MachineSettings:
    """Read a machine: one file with `[[actuator]]`, or the files of a single actuator.

    Raises:
        UserError: with every mistake found, each with its place.

    """
    if len(files) != 1 or not has_actuators(files[0]):
        config = load_rig(files)
        name = config.files[0].stem
        only = ActuatorSettings(name, config, ONLY_BUS)
        return MachineSettings((only,), {ONLY_BUS: config.bus}, {ONLY_BUS: config.wire})
    (file,) = files
    table = _checked(file)
    places = {name: place for place, name in enumerate(table.buses)}
    actuators = tuple(
        _actuator(file, i, a, places.get(a.bus, 0), _supply_files(file, table, a))
        for i, a in enumerate(table.actuator)
    )
    _check_together(file, table, actuators)
    actuators = with_legs(str(file), _sharing(file, table, actuators))
    made = {name: split(bus) for name, bus in table.buses.items()}
    buses = {name: arguments for name, (arguments, _) in made.items()}
    return MachineSettings(actuators, buses, {name: wire for name, (_, wire) in made.items()})


def has_actuators(file: Path) -> bool:
    """Return whether a file describes a machine of several actuators."""
    try:
        return "actuator" in read_toml(file, "configuration")
    except UserError:
        return False  # `load` reports the error


def _checked(file: Path) -> MachineTable:
    content = read_toml(file, "machine")
    try:
        return MachineTable.model_validate(content)
    except ValidationError as error:
        origin: dict[tuple[str, ...], Path] = {(key,): file for key in content}
        raise UserError(describe(error, MachineTable, content, origin, [file])) from None


def _supply_files(file: Path, table: MachineTable, actuator: ActuatorTable) -> tuple[str, ...]:
    """Return the files of the supply that an actuator shares; empty for its own supply."""
    if actuator.supply is None:
        return ()
    if actuator.supply not in table.supplies:
        names = ", ".join(table.supplies) or "no supplies; add [supplies.NAME] with its files"
        raise UserError(
            f"{file}: actuator {actuator.name}: there is no supply '{actuator.supply}'; "
            f"there are: {names}"
        )
    return table.supplies[actuator.supply].files


def _sharing(
    file: Path, table: MachineTable, actuators: tuple[ActuatorSettings, ...]
) -> tuple[ActuatorSettings, ...]:
    """Return the actuators, after a check that those on one supply agree in its parameters."""
    for supply in table.supplies:
        on_it = {a.name: a.config for a in actuators if a.supply == supply}
        if not on_it:
            raise UserError(
                f'{file}: no actuator is on supply {supply}; write supply = "{supply}" in its '
                "[[actuator]]"
            )
        agreed = on_one_supply(f"{file}: supply {supply}", on_it)
        actuators = tuple(
            dataclasses.replace(a, config=agreed.get(a.name, a.config)) for a in actuators
        )
    return actuators


def _actuator(
    file: Path, position: int, table: ActuatorTable, bus: int, supply: tuple[str, ...]
) -> ActuatorSettings:
    """Load one actuator; its noise and serial numbers differ from those of the others."""
    config = load_rig([file.parent / name for name in (*table.files, *supply)])
    nodes = tuple(
        dataclasses.replace(n, id=_offset(n.id, table.node_offset), bus_number=bus)
        for n in config.nodes
    )
    config = dataclasses.replace(config, nodes=nodes, seed=config.seed + position)
    return ActuatorSettings(table.name, config, table.bus, table.supply, table.carries)


def _offset(number: int, offset: int) -> int:
    return number if number == UNCONFIGURED else number + offset


def _check_together(file: Path, table: MachineTable, actuators: Sequence[ActuatorSettings]) -> None:
    """Refuse conflicts between actuators."""
    taken: dict[tuple[str, int], str] = {}
    names = [actuator.name for actuator in actuators]
    for actuator in actuators:
        if names.count(actuator.name) > 1:
            raise UserError(f"{file}: two actuators are called {actuator.name}; rename one")
        if actuator.bus not in table.buses:
            raise UserError(
                f"{file}: actuator {actuator.name}: there is no bus '{actuator.bus}'; "
                f"there are: {', '.join(table.buses)}"
            )
        if actuator.config.tick_ns != actuators[0].config.tick_ns:
            raise UserError(
                f"{file}: actuator {actuator.name}: its tick is not that of {actuators[0].name}; "
                "one loop has one tick"
            )
        for node in actuator.config.nodes:
            if node.id == UNCONFIGURED:
                continue
            if node.id > 127:
                raise UserError(
                    f"{file}: actuator {actuator.name}: node-ID {node.id} is above 127; "
                    "choose a smaller node_offset"
                )
            other = taken.setdefault((actuator.bus, node.id), actuator.name)
            if other != actuator.name:
                raise UserError(
                    f"{file}: on bus {actuator.bus}, {other} and {actuator.name} both have a node "
                    f"{node.id}; give them different node_offset"
                )
