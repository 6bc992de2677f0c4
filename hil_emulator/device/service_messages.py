"""The messages of CiA 301 other than PDOs, in a node's present configuration, for bus databases.

NMT, SYNC and TIME belong to the bus unless a node produces them; EMCY, heartbeat and SDO belong to
one node. `event_timer_ms` of a periodic message is its period, as for PDOs.
"""

from collections.abc import Iterator, Mapping

from hil_emulator.device import cob_id, nmt
from hil_emulator.device.dictionary import UNCONFIGURED, Dictionary
from hil_emulator.device.emergency import EMCY_BASE, EMCY_COB_ID, ErrorCode
from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID, PRODUCER_HEARTBEAT_TIME
from hil_emulator.device.message import Field, Message
from hil_emulator.device.node import Node
from hil_emulator.device.pdo import EVENT_PROFILE
from hil_emulator.device.sdo_channels import servers
from hil_emulator.device.sync import (
    COMMUNICATION_CYCLE_PERIOD,
    SYNC_COB_ID,
    SYNC_COUNTER_OVERFLOW,
)
from hil_emulator.device.time_stamp import PERIOD_NS, TIME_COB_ID

BUS = ""
"""In place of a node's name: the message belongs to the bus."""

WORDS: Mapping[str, Mapping[int, str]] = {
    "nmt_command": {command: command.name.lower() for command in nmt.Command},
    "nmt_state": {state: state.name.lower() for state in nmt.State} | {0: "boot_up"},
    "error_code": {code: code.name.lower() for code in ErrorCode},
    "sdo_request": {
        0x2F: "download_1_byte", 0x2B: "download_2_bytes", 0x27: "download_3_bytes",
        0x23: "download_4_bytes", 0x21: "download_segmented", 0x40: "upload",
        0x60: "upload_segment", 0x70: "upload_segment_toggled", 0x80: "abort",
    },
    "sdo_answer": {
        0x60: "downloaded", 0x20: "segment_downloaded", 0x30: "segment_downloaded_toggled",
        0x4F: "uploaded_1_byte", 0x4B: "uploaded_2_bytes", 0x47: "uploaded_3_bytes",
        0x43: "uploaded_4_bytes", 0x41: "upload_segmented", 0x80: "abort",
    },
}  # fmt: skip
"""Meaning of values, by the name in `Field.choices` (CiA 301 7.2.4.3, 7.2.7.1, 7.2.8)."""

_NS_PER_MS = 1_000_000
_US_PER_MS = 1_000


def _field(
    name: str, start: int, bits: int, choices: str = "", factor: float = 1.0, unit: str = ""
) -> Field:
    return Field(
        name, start, bits, signed=False, real=False, factor=factor, unit=unit, choices=choices
    )


_NMT = (_field("command", 0, 8, "nmt_command"), _field("node", 8, 8))
_COUNTER = (_field("counter", 0, 8),)
_TIME_OF_DAY = (_field("time_of_day", 0, 28, factor=1e-3, unit="s"), _field("days", 32, 16))
_EMERGENCY = (
    _field("error_code", 0, 16, "error_code"),
    _field("error_register", 16, 8),
    _field("manufacturer", 24, 40),
)
_ERROR_CONTROL = (_field("state", 0, 7, "nmt_state"), _field("toggle", 7, 1))


def services(nodes: Mapping[str, Node]) -> list[Message]:
    """Return the messages of a bus other than PDOs, each identifier once.

    Args:
        nodes: the nodes on the bus, by name.

    """
    messages = {nmt.NMT_COB_ID: _message(BUS, "NMT", nmt.NMT_COB_ID, 2, _NMT)}
    for name, node in nodes.items():
        if node.node_id != UNCONFIGURED:
            for message in _of_node(name, node.dictionary):
                present = messages.get(message.can_id)
                if present is None or (present.node == BUS and message.node != BUS):
                    messages[message.can_id] = message
    return list(messages.values())


def _of_node(name: str, dictionary: Dictionary) -> Iterator[Message]:
    number = dictionary.node_id
    yield from _sync(name, dictionary)
    yield from _time(name, dictionary)
    emergency = _value(dictionary, EMCY_COB_ID, EMCY_BASE + number)
    if not emergency & cob_id.INVALID:
        yield _message(name, "EMCY", cob_id.number(emergency), 8, _EMERGENCY)
    heartbeat_ms = _value(dictionary, PRODUCER_HEARTBEAT_TIME, 0)
    can_id = ERROR_CONTROL_COB_ID + number
    yield _message(name, "heartbeat", can_id, 1, _ERROR_CONTROL, heartbeat_ms)
    for place, server in enumerate(servers(dictionary).values()):
        if server.exists:
            channel = f"SDO{place + 1}" if place else "SDO"
            request = _sdo("sdo_request")
            yield _message(name, f"{channel}_request", server.request_can_id, 8, request)
            yield _message(name, f"{channel}_answer", server.answer_can_id, 8, _sdo("sdo_answer"))


def _sync(name: str, dictionary: Dictionary) -> Iterator[Message]:
    value = _value(dictionary, SYNC_COB_ID, 0)
    if value:
        produced = bool(value & cob_id.PRODUCER)
        period_us = _value(dictionary, COMMUNICATION_CYCLE_PERIOD, 0) if produced else 0
        counted = bool(_value(dictionary, SYNC_COUNTER_OVERFLOW, 0))
        fields = _COUNTER if counted else ()
        sender, can_id = name if produced else BUS, cob_id.number(value)
        yield _message(sender, "SYNC", can_id, len(fields), fields, period_us // _US_PER_MS)


def _time(name: str, dictionary: Dictionary) -> Iterator[Message]:
    value = _value(dictionary, TIME_COB_ID, 0)
    if value:
        produced = bool(value & cob_id.PRODUCER)
        period_ms = PERIOD_NS // _NS_PER_MS if produced else 0
        sender, can_id = name if produced else BUS, cob_id.number(value)
        yield _message(sender, "TIME", can_id, 6, _TIME_OF_DAY, period_ms)


def _sdo(choices: str) -> tuple[Field, ...]:
    """Return the fields of an initiate or an abort; for segments only the command is valid."""
    return (
        _field("command", 0, 8, choices),
        _field("index", 8, 16),
        _field("subindex", 24, 8),
        _field("data", 32, 32),
    )


def _message(
    node: str, service: str, can_id: int, size: int, fields: tuple[Field, ...], period_ms: int = 0
) -> Message:
    return Message(node, service, can_id, size, EVENT_PROFILE, period_ms, fields)


def _value(dictionary: Dictionary, index: int, missing: int) -> int:
    entry = dictionary.get(index)
    return missing if entry is None else int(entry.value)
