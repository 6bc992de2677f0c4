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
"""The DBC's name for whoever sends set points."""


def dbc(messages: Iterable[message.Message], sync_ms: int) -> str:
    """Return the text of a DBC file.

    Args:
        messages: the PDOs on the bus, and the messages of other services.
        sync_ms: period of SYNC, 0 where there is none.

    """
    known = list(messages)
    nodes = list(dict.fromkeys(identifier(m.node) for m in known if m.node != BUS))
    database = Database(
        messages=[_message(m, nodes, sync_ms) for m in known],
        nodes=[Node(CONTROLLER), *(Node(name) for name in nodes)],
        version="",
    )
    return database.as_dbc_string().replace("\r\n", "\n")


def identifier(text: str) -> str:
    """Return a name of letters, digits and underscores, as DBC asks."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "unnamed"
    return f"_{name}" if name[0].isdigit() else name


def _message(known: message.Message, nodes: list[str], sync_ms: int) -> Message:
    """Return a message of the database; what is the bus's comes from the controller for all."""
    own = identifier(known.node)
    if known.node == BUS:
        sender, receivers = CONTROLLER, nodes
    else:
        sender, receivers = (CONTROLLER, [own]) if known.receive else (own, [CONTROLLER])
    is_pdo = "PDO" in known.pdo
    return Message(
        frame_id=known.can_id,
        is_extended_frame=known.extended,
        name=identifier(known.name),
        length=known.size,
        signals=list(_signals(known.fields, receivers)),
        senders=[sender],
        cycle_time=_cycle_ms(known, sync_ms),
        comment=f"{known.pdo}, transmission type {known.transmission_type}" if is_pdo else None,
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
    """Return the period in ms, None where the message has none of its own."""
    kind = pdo.transmission_type
    if pdo.pdo == "SYNC":
        return pdo.event_timer_ms or sync_ms or None
    if 1 <= kind <= SYNC_CYCLIC_MAX:
        return kind * sync_ms or None
    if kind >= EVENT_MANUFACTURER and not pdo.receive:
        return pdo.event_timer_ms or None
    return None
