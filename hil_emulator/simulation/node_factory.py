"""Assembly of the CANopen nodes of a configuration."""

import logging
from collections.abc import Sequence

from hil_emulator.config.load import Configuration
from hil_emulator.config.nodes import UNCONFIGURED, NodeSettings
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.simulation.object_wiring import set_constant, wire
from hil_emulator.simulation.parameter_store import ParameterFile

SERIAL_NUMBER = (0x1018, 4)
NODES_PER_BUS = 128
"""Distance between the serial numbers of the nodes of two buses."""
UNCONFIGURED_SERIALS = 0x10000
"""First serial number of nodes without a node-ID, above those of all buses."""

_log = logging.getLogger(__name__)


def nodes(config: Configuration, channels: Sequence[str]) -> list[Node]:
    """Create the CANopen nodes of a configuration.

    Raises:
        UserError: if an EDS is missing or wrong, has no object that the configuration names, or
            excludes its bit rate, or the folder of stored parameters cannot be used.

    """
    return [_node(settings, place, channels) for place, settings in enumerate(config.nodes)]


def _node(settings: NodeSettings, place: int, channels: Sequence[str]) -> Node:
    dictionary = Dictionary.from_eds(settings.eds, settings.id)
    if dictionary.remarks:
        _log.info("%s: %d oddities; check lists them", settings.eds, len(dictionary.remarks))
    dictionary.extended_ids = settings.extended_ids
    _check_bit_rate(dictionary, settings.bit_rate)
    _identify(dictionary, settings, place)
    courses = [] if settings.objects is None else wire(dictionary, settings.objects)
    commands = settings.commands
    if settings.any_commands:
        commands = {name: safe for name, safe in commands.items() if dictionary.named(name)}
    kept = None
    if settings.storage is not None:
        file = settings.storage / f"node_{_file_number(dictionary, settings.id)}.json"
        kept = ParameterFile(file, dictionary, _log.warning)
    return Node(dictionary, channels, commands, kept, courses, settings.autostart)


def _check_bit_rate(dictionary: Dictionary, rate: float | None) -> None:
    if rate is not None and dictionary.bit_rates and rate not in dictionary.bit_rates:
        able = ", ".join(f"{r / 1e3:g}" for r in sorted(dictionary.bit_rates))
        raise UserError(
            f"{dictionary.source}: bit_rate {rate / 1e3:g} kbit/s is not supported by the device, "
            f"which has {able}"
        )


def _identify(dictionary: Dictionary, settings: NodeSettings, place: int) -> None:
    """Set the identity of a node; by default its serial number is unique.

    LSS distinguishes nodes without a node-ID by vendor, product, revision and serial number.
    """
    for (index, subindex), value in settings.identity.items():
        entry = dictionary.get(index, subindex)
        if entry is None:
            raise UserError(
                f"{dictionary.source} has no object 0x{index:04X}:{subindex:02X} for the identity "
                "in the configuration"
            )
        set_constant(dictionary, entry, value)
    entry = dictionary.get(*SERIAL_NUMBER)
    if entry is None:
        return
    serial = settings.id if settings.id != UNCONFIGURED else UNCONFIGURED_SERIALS + place
    serial += settings.bus_number * NODES_PER_BUS
    dictionary.set_default(entry, settings.serial_number or entry.default or serial)


def _file_number(dictionary: Dictionary, node_id: int) -> str:
    """Return the number in the name of a node's file: its node-ID, or its serial number."""
    entry = dictionary.get(*SERIAL_NUMBER)
    lacks = node_id == UNCONFIGURED and entry is not None
    return f"serial_{entry.default}" if lacks and entry else str(node_id)
