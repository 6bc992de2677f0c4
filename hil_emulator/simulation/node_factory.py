"""The CANopen nodes that a configuration describes."""

import logging
from collections.abc import Sequence

from hil_emulator.config.load import Configuration, NodeSettings
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.simulation.parameter_store import ParameterFile

SERIAL_NUMBER = (0x1018, 4)
NODES_PER_BUS = 128
"""What serial numbers of one bus's nodes are apart from those of the next."""

_log = logging.getLogger(__name__)


def nodes(config: Configuration, channels: Sequence[str]) -> list[Node]:
    """Make the CANopen nodes of a configuration.

    Raises:
        UserError: if an EDS is missing, wrong, or maps what nothing feeds, or the folder of
            stored parameters cannot be used.

    """
    return [_node(settings, channels) for settings in config.nodes]


def _node(settings: NodeSettings, channels: Sequence[str]) -> Node:
    dictionary = Dictionary.from_eds(settings.eds, settings.id)
    _identify(dictionary, settings)
    if settings.storage is None:
        return Node(dictionary, channels, settings.commands)
    file = settings.storage / f"node_{settings.id}.json"
    kept = ParameterFile(file, dictionary, _log.warning)
    return Node(dictionary, channels, settings.commands, kept)


def _identify(dictionary: Dictionary, settings: NodeSettings) -> None:
    """Give a node its serial number: as configured, as in its EDS, or one no other node has.

    By vendor, product, revision and serial number LSS tells nodes apart that have no node-ID.
    """
    entry = dictionary.get(*SERIAL_NUMBER)
    if entry is None:
        return
    own = settings.bus_number * NODES_PER_BUS + settings.id
    dictionary.set_default(entry, settings.serial_number or entry.default or own)
