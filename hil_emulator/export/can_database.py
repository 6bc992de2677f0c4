"""The DBC of a bus: every PDO with names, units, scaling and cycle time, and the other services."""

import re
from collections import OrderedDict
from collections.abc import Iterable, Iterator

from cantools.database import Database, Message, Node, Signal
from cantools.database.conversion import BaseConversion

from hil_emulator.device import message
from hil_emulator.device.pdo import EVENT_MANUFACTURER, SYNC_CYCLIC_MAX
from hil_emulator.device.service_messages import BUS, WORDS

CONTROLLER = "controller"
"""Node name in the DBC of the sender of set points."""


def dbc(messages: Iterable[message.Message], sync_ms: int) -> str:
    """Return the text of a DBC file.

    Args:
        messages: the PDOs on the bus, and the messages of other services.
        sync_ms: period of SYNC [ms]; 0 without SYNC.

    """
    listed = list(messages)
    nodes = list(dict.fromkeys(identifier(m.node) for m in listed if m.node != BUS))
    database = Database(
        messages=[_message(m, nodes, sync_ms) for m in listed],
        nodes=[Node(CONTROLLER), *(Node(name) for name in nodes)],
        version="",
    )
    return database.as_dbc_string().replace("\r\n", "\n")


def identifier(text: str) -> str:
    """Return a name of letters, digits and underscores, as DBC asks."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "unnamed"
    return f"_{name}" if name[0].isdigit() else name


def _message(source: message.Message, nodes: list[str], sync_ms: int) -> Message:
    """Return a message of the database; messages of the bus go from the controller to all nodes."""
    node = identifier(source.node)
    if source.node == BUS:
        sender, receivers = CONTROLLER, nodes
    else:
        sender, receivers = (CONTROLLER, [node]) if source.receive else (node, [CONTROLLER])
    is_pdo = "PDO" in source.pdo
    return Message(
        frame_id=source.can_id,
        is_extended_frame=source.extended,
        name=identifier(source.name),
        length=source.size,
        signals=list(_signals(source.fields, receivers)),
        senders=[sender],
        cycle_time=_cycle_ms(source, sync_ms),
        comment=f"{source.pdo}, transmission type {source.transmission_type}" if is_pdo else None,
    )


def _signals(fields: Iterable[message.Field], receivers: list[str]) -> Iterator[Signal]:
    """Yield a signal for each mapped object, each with a name of its own."""
    taken: set[str] = set()
    for field in fields:
        name = identifier(field.name)
        if name in taken:
            name = f"{name}_{field.index:04X}_{field.subindex:02X}"
        taken.add(name)
        yield _signal(field, name, receivers)


def _signal(field: message.Field, name: str, receivers: list[str]) -> Signal:
    limits = [
        None if v is None else v * field.factor + field.offset for v in (field.low, field.high)
    ]
    return Signal(
        name=name,
        start=field.start,
        length=field.bits,
        is_signed=field.signed,
        conversion=BaseConversion.factory(
            scale=field.factor,
            offset=field.offset,
            is_float=field.real,
            choices=OrderedDict(WORDS.get(field.choices, {})) or None,
        ),
        minimum=limits[0],
        maximum=limits[1],
        unit=field.unit or None,
        receivers=receivers,
        comment=f"object 0x{field.index:04X}:{field.subindex:02X}" if field.index else None,
    )


def _cycle_ms(pdo: message.Message, sync_ms: int) -> int | None:
    """Return the message's period [ms]; None if it is not periodic."""
    kind = pdo.transmission_type
    if pdo.pdo == "SYNC":
        return pdo.event_timer_ms or sync_ms or None
    if 1 <= kind <= SYNC_CYCLIC_MAX:
        return kind * sync_ms or None
    if kind >= EVENT_MANUFACTURER and not pdo.receive:
        return pdo.event_timer_ms or None
    return None
