"""The DBC of a bus: every PDO with names, units, scaling and cycle time."""

import re
from collections.abc import Iterator, Mapping

from cantools.database import Database, Message, Node, Signal
from cantools.database.conversion import BaseConversion

from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo import EVENT_MANUFACTURER, SYNC_CYCLIC_MAX, PdoParameters

CONTROLLER = "controller"
"""The DBC's name for whoever sends set points."""


def database(nodes: Mapping[str, list[PdoParameters]], sync_ms: int) -> Database:
    """Return the database of a bus.

    Args:
        nodes: the PDOs of each node, by the node's name.
        sync_ms: period of SYNC, 0 where there is none.

    """
    messages = [
        _message(name, parameters, sync_ms)
        for name, pdos in nodes.items()
        for parameters in pdos
        if parameters.active
    ]
    names = [Node(CONTROLLER), *(Node(identifier(name)) for name in nodes)]
    return Database(messages=messages, nodes=names, version="")


def identifier(text: str) -> str:
    """Return a name of letters, digits and underscores, as DBC asks."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "unnamed"
    return f"_{name}" if name[0].isdigit() else name


def _message(name: str, parameters: PdoParameters, sync_ms: int) -> Message:
    node = identifier(name)
    sender, receiver = (CONTROLLER, node) if parameters.receive else (node, CONTROLLER)
    return Message(
        frame_id=parameters.can_id,
        name=f"{node}_{parameters.name}",
        length=parameters.mapping.size,
        signals=list(_signals(parameters, receiver)),
        senders=[sender],
        cycle_time=_cycle_ms(parameters, sync_ms),
        comment=f"{parameters.name}, transmission type {parameters.transmission_type}",
    )


def _signals(parameters: PdoParameters, receiver: str) -> Iterator[Signal]:
    """Yield a signal for each mapped object; dummies leave a gap."""
    start = 0
    taken: set[str] = set()
    for entry in parameters.mapping.entries:
        if entry.index >= 0x1000:
            name = identifier(entry.name)
            if name in taken:
                name = f"{name}_{entry.index:04X}_{entry.subindex:02X}"
            taken.add(name)
            yield _signal(entry, name, start, receiver)
        start += entry.type.bits


def _signal(entry: Entry, name: str, start: int, receiver: str) -> Signal:
    real = entry.type.kind == "real"
    limits = [None if v is None else v * entry.factor for v in (entry.low, entry.high)]
    return Signal(
        name=name,
        start=start,
        length=entry.type.bits,
        is_signed=entry.type.low < 0,
        conversion=BaseConversion.factory(scale=entry.factor, offset=0, is_float=real),
        minimum=limits[0],
        maximum=limits[1],
        unit=entry.unit or None,
        receivers=[receiver],
        comment=f"object {entry.where}",
    )


def _cycle_ms(parameters: PdoParameters, sync_ms: int) -> int | None:
    """Return the period in ms, None where the PDO has none of its own."""
    kind = parameters.transmission_type
    if 1 <= kind <= SYNC_CYCLIC_MAX:
        return kind * sync_ms or None
    if kind >= EVENT_MANUFACTURER and not parameters.receive:
        return parameters.event_timer_ms or None
    return None
