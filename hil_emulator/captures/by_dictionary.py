"""Carriers of channels from object dictionaries: of a configuration's nodes, an EDS or a DCF."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from hil_emulator.captures.carrier import COUNTER, Carrier, Signal, channel_of
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.eds.load import commissioned
from hil_emulator.device.entry import Entry
from hil_emulator.device.layout import checked_parameters
from hil_emulator.device.message import Field, field
from hil_emulator.device.pdo import EVENT_MANUFACTURER, SYNC_CYCLIC_MAX, PdoParameters
from hil_emulator.device.pdo_records import MAX_PDOS, RPDO_COMMUNICATION, TPDO_COMMUNICATION
from hil_emulator.device.set_points import SAFE_SUFFIX
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import KNOWN, SET_POINT

FULL_SCALE = 16384
"""Digits of 100 % (CiA 408)."""

_VALVE_PROFILE = 408
_SET_POINT_VALUE = (0x6300, 1)
_CONTROL_WORD = (0x6040, 0)
_ACTIVE = 0b111  # a set point is valid only if D, H and M are set (CiA 408)
_SYNC_COB_ID = (0x1005, 0)
_CAN_ID = 0x7FF


def from_file(file: Path, node_id: int | None = None) -> list[Carrier]:
    """Return the PDOs of an EDS or DCF.

    Args:
        file: EDS or DCF.
        node_id: node-ID for an EDS; a DCF contains its node-ID.

    Raises:
        UserError: if the file is not an EDS, or the node-ID is unknown.

    """
    stored_id = commissioned(file)
    number = stored_id if stored_id is not None else node_id
    if number is None:
        raise UserError(f"{file}: which node is it? Give --node, or a DCF, which has the node-ID")
    dictionary = Dictionary.from_eds(file, number)
    indices = {entry.index for entry in dictionary}
    pdos = [
        checked_parameters(dictionary, n, receive=receive)
        for receive, first in ((True, RPDO_COMMUNICATION), (False, TPDO_COMMUNICATION))
        for n in range(1, MAX_PDOS + 1)
        if first + n - 1 in indices
    ]
    of_file = carriers(dictionary, pdos)
    if not any(s.name in KNOWN for c in of_file for s in c.signals):
        raise UserError(
            f"{file}: no PDO maps a known channel; give objects a Signal, Unit and "
            "Factor, such as [Comments] Line1=6130sub1: Signal=pressure_a Unit=bar Factor=1"
        )
    return of_file


def carriers(dictionary: Dictionary, pdos: Iterable[PdoParameters]) -> list[Carrier]:
    """Return the PDOs of a node as they are configured now."""
    return [_carrier(dictionary, pdo) for pdo in pdos if pdo.active]


SYNC = 0x080
"""Default identifier of SYNC (CiA 301, 7.3.5)."""


def sync_id(dictionary: Dictionary) -> int:
    """Return the identifier of SYNC."""
    entry = dictionary.get(*_SYNC_COB_ID)
    return SYNC if entry is None else int(entry.value) & _CAN_ID


def _carrier(dictionary: Dictionary, pdo: PdoParameters) -> Carrier:
    fields: dict[str, Field] = {}
    signals = []
    modulus = 0
    control = ""
    for start, entry in pdo.mapping.placed():
        name, factor, unit = _meaning(dictionary, entry)
        fields[name] = dataclasses.replace(field(start, entry), factor=factor, unit=unit)
        signals.append(Signal(name, unit or None, name))
        if name == COUNTER:
            modulus = 1 << entry.type.bits
        if (entry.index, entry.subindex) == _CONTROL_WORD:
            control = name

    def decode(data: bytes) -> Mapping[str, float]:
        values = {name: place.value(data) for name, place in fields.items()}
        if control and int(values[control]) & _ACTIVE != _ACTIVE:
            values.pop(SET_POINT, None)
        return values

    kind = pdo.transmission_type
    timed = pdo.event_timer_ms * 1e-3 if kind >= EVENT_MANUFACTURER else 0.0
    return Carrier(
        f"{pdo.name} of node {dictionary.node_id}", pdo.can_id, pdo.extended, pdo.mapping.size,
        tuple(signals), decode, synchronous=pdo.receive and kind <= SYNC_CYCLIC_MAX,
        deadline=timed if pdo.receive else 0.0, safe=_safe(dictionary),
        period=0.0 if pdo.receive else timed, counter_modulus=modulus,
    )  # fmt: skip


def _safe(dictionary: Dictionary) -> float | None:
    """Return the value that a device uses without a valid set point; None if not stated."""
    entry = dictionary.named(SET_POINT + SAFE_SUFFIX)
    return None if entry is None or not entry.unit else entry.physical(entry.value)


def _meaning(dictionary: Dictionary, entry: Entry) -> tuple[str, float, str]:
    """Return the channel or name of an object, the value of a digit, and its unit."""
    device_type = dictionary.get(0x1000)
    valve = device_type is not None and int(device_type.value) & 0xFFFF == _VALVE_PROFILE
    if valve and (entry.index, entry.subindex) == _SET_POINT_VALUE and not entry.unit:
        return SET_POINT, 100.0 / FULL_SCALE, "%"
    return channel_of(entry.signal, entry.unit), entry.factor, entry.unit


def from_files(files: Sequence[Path], node_ids: Sequence[int]) -> list[Carrier]:
    """Return the PDOs of several files; those without a node-ID take `node_ids` in turn.

    Raises:
        UserError: as `from_file`; or if there are more node-IDs than files without one.

    """
    left = list(node_ids)
    of_files: list[Carrier] = []
    for file in files:
        asks = commissioned(file) is None and left
        of_files += from_file(file, left.pop(0) if asks else None)
    if left:
        raise UserError(f"--node {left[0]}: no EDS is left for it; each takes one, in their order")
    return of_files
