"""The tables of a node: bindings of its objects, and contents of its PDOs."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from hil_emulator.device.abort import SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.mapping import resolve
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.device.pdo_records import RPDO_MAPPING, TPDO_MAPPING
from hil_emulator.errors import UserError

MANUFACTURER_OBJECTS = 0x2000
"""Below this index services of the device feed every object (CiA 301 7.4)."""


@dataclass(frozen=True, slots=True)
class Binding:
    """One row of the binding table."""

    index: int
    subindex: int
    name: str
    type: str
    unit: str
    factor: float
    offset: float
    bound_to: str


class PdoRow(NamedTuple):
    """One PDO as it is configured now; `entries` is empty while it does not exist."""

    name: str
    can_id: int
    exists: bool
    transmission_type: int
    event_timer_ms: int
    inhibit_us: int
    size: int
    entries: tuple[str, ...]


def bindings(dictionary: Dictionary, sources: Mapping[tuple[int, int], str]) -> list[Binding]:
    """Return the table of all objects from 0x2000 on; `bound_to` is "" for those unbound."""
    return [
        Binding(
            entry.index,
            entry.subindex,
            entry.name,
            entry.type.name,
            entry.unit,
            entry.factor,
            entry.offset,
            sources.get((entry.index, entry.subindex), ""),
        )
        for entry in sorted(dictionary, key=lambda entry: (entry.index, entry.subindex))
        if entry.index >= MANUFACTURER_OBJECTS
    ]


def pdo_row(parameters: PdoParameters) -> PdoRow:
    """Return a PDO's row of the PDO map."""
    return PdoRow(
        parameters.name,
        parameters.can_id,
        parameters.exists,
        parameters.transmission_type,
        parameters.event_timer_ms,
        parameters.inhibit_us,
        parameters.mapping.size,
        tuple(entry.name for entry in parameters.mapping.entries),
    )


def checked_parameters(dictionary: Dictionary, number: int, *, receive: bool) -> PdoParameters:
    """Return a PDO's parameters, or refuse an impossible default mapping or identifier.

    Raises:
        UserError: names the mapping entry and the object, or the PDO with a 29-bit identifier on
            a device with `extended_ids = false`.

    """
    try:
        parameters = PdoParameters(dictionary, number, receive=receive)
    except SdoAbort as abort:
        refusal = abort
    else:
        if parameters.exists and parameters.extended and not dictionary.extended_ids:
            raise UserError(
                f"{dictionary.source}: {parameters.name} has a 29-bit identifier, but the node "
                "has extended_ids = false; leave that out, or give the PDO another COB-ID"
            )
        return parameters
    first = (RPDO_MAPPING if receive else TPDO_MAPPING) + number - 1
    for word in [entry for entry in dictionary if entry.index == first and entry.subindex]:
        try:
            resolve(dictionary, word.value, receive=receive)
        except SdoAbort as abort:
            index, subindex, bits = word.value >> 16, word.value >> 8 & 0xFF, word.value & 0xFF
            raise UserError(
                f"{dictionary.source} [{word.section}] maps "
                f"0x{index:04X}:{subindex:02X} with {bits} bits: {abort}; map an object that "
                "exists, with PDOMapping=1, a fitting AccessType and its own length"
            ) from None
    raise UserError(f"{dictionary.source} [{first:04X}]: the default mapping is refused, {refusal}")


def unfed(
    pdos: Iterable[PdoParameters], sources: Mapping[tuple[int, int], str]
) -> list[tuple[str, Entry]]:
    """Return each object in a TPDO without a source of values, with the TPDO's name.

    Such an object holds its default. An object that a master may write has the master as source.
    """
    return [
        (pdo.name, entry)
        for pdo in pdos
        if not pdo.receive and pdo.active
        for entry in pdo.mapping.entries
        if entry.index >= MANUFACTURER_OBJECTS
        and not entry.writable
        and (entry.index, entry.subindex) not in sources
    ]
