"""Reading an EDS or DCF (CiA 306): entries, remarks, bit rates and the node-ID.

These keys beyond CiA 306 tie an object to the physics behind it:

| key | meaning |
|---|---|
| Unit, Factor | one digit stands for `Factor` of the SI unit `Unit` |
| Offset | value of 0 digits in `Unit`, such as -62.5 bar of a 4 to 20 mA input |
| Signal | the channel it shows or the command it gives, where that is not its ParameterName |
| Delta | change in digits that is an event for an event-driven TPDO |

They stand in the object's section. For checkers that accept only keys of CiA 306 they may stand in
a line of `[Comments]`: `Line1=6100sub1: Signal=pressure_a Unit=Pa Factor=2500000`. Such a line may
also give the DefaultValue or ParameterValue of a real number, which tools write in different ways.
"""

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.device.datatype import DATA_TYPES
from hil_emulator.device.eds import compact, standard_values
from hil_emulator.device.eds.compact import number
from hil_emulator.device.eds.default_mappings import DefaultMappings
from hil_emulator.device.eds.objects import ObjectReader
from hil_emulator.device.eds.report import Remark, Report
from hil_emulator.device.eds.sections import Sheet, parse, read
from hil_emulator.device.entry import Entry
from hil_emulator.errors import UserError

MOST_ENTRIES = 200_000
"""Entries of a device, expanded: 0.25 GB of memory; real devices have 10,000 (assumed)."""

MANDATORY_OBJECTS = (0x1000, 0x1001)
"""CiA 301 7.5.1: device type and error register."""
IDENTITY = 0x1018
"""Mandatory as well, but missing in older devices."""
BIT_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""Bit rates that `[DeviceInfo]` has keys for [kbit/s]."""
DUMMY_TYPES = range(1, 8)

_INTEGERS = (
    range(0x1000, 0x1008), range(0x100C, 0x100E), range(0x1010, 0x1021), range(0x1028, 0x102A),
    range(0x1200, 0x1300), range(0x1400, 0x1C00),
)  # fmt: skip
"""Objects of CiA 301 that services of a device compute with and that hold only integers."""

BINDING = re.compile(r"^([0-9A-Fa-f]{4}(?:sub[0-9A-Fa-f]+)?):((?: \w+=\S+)+)$")
"""A line of [Comments] that gives keys to an object's section."""

_LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_COMMISSIONING = ("DeviceComissioning", "DeviceCommissioning")
"""CiA 306 spells it the first way, some tools the second."""


@dataclass(frozen=True, slots=True)
class DataSheet:
    """The content of a file.

    Attributes:
        entries: every entry, dummy types (index 1 to 7) included.
        remarks: deviations from CiA 306.
        bit_rates: bit rates that the device supports [bit/s]; empty if the file lists no rate.

    """

    entries: Sequence[Entry]
    remarks: Sequence[Remark]
    bit_rates: frozenset[int]


def load(path: Path, node_id: int) -> DataSheet:
    """Read a file.

    Args:
        path: the file.
        node_id: replaces `$NODEID`, 1 to 127.

    Raises:
        UserError: the file is missing, is not an EDS, is that of a modular device, describes an
            object twice, has too many objects, lacks a mandatory object, or has a value without
            meaning; the message names section and key.

    """
    report = Report(str(path))
    sheet = parse(read(path), report)
    _refuse_modular(sheet, report)
    _note_node_id(sheet, node_id, report)
    _add_bindings(sheet)
    compact.add_pdos(sheet, report)
    standard_values.fill(sheet, report)
    entries = list(itertools.islice(ObjectReader(sheet, node_id, report).entries(), MOST_ENTRIES))
    if len(entries) == MOST_ENTRIES:
        raise UserError(f"{path}: describes {MOST_ENTRIES} entries or more; leave unused ones out")
    indices = {entry.index for entry in entries}
    _check_indices(sheet, indices, report)
    _check_integers(entries, report)
    DefaultMappings(entries, report).admit()
    rates = {
        k * 1000 for k in BIT_RATES if number(sheet.get("DeviceInfo"), f"BaudRate_{k}", report)
    }
    return DataSheet([*_dummies(sheet, report), *entries], report.remarks, frozenset(rates))


def _check_integers(entries: Iterable[Entry], report: Report) -> None:
    for entry in entries:
        if entry.type.kind != "integer" and any(entry.index in indices for indices in _INTEGERS):
            text = f"{entry.type.name}, where CiA 301 has an integer"
            raise report.refusal(entry.section, "DataType", text)


def commissioned(path: Path) -> int | None:
    """Return the node-ID of a DCF; None for an EDS.

    Raises:
        UserError: the file cannot be read, or its node-ID is not a number.

    """
    report = Report(str(path))
    return _node_id(parse(read(path), report), report)


def _node_id(sheet: Sheet, report: Report) -> int | None:
    numbers = [number(sheet.get(name), "NodeID", report) for name in _COMMISSIONING]
    return next(filter(None, numbers), None)


def _note_node_id(sheet: Sheet, node_id: int, report: Report) -> None:
    file_id = _node_id(sheet, report)
    if file_id not in (None, node_id):
        text = f"{file_id}, but this is node {node_id}; COB-IDs may be those of the other one"
        report.note(_COMMISSIONING[0], "NodeID", text)


def _refuse_modular(sheet: Sheet, report: Report) -> None:
    section = sheet.get("SupportedModules")
    modules = number(section, "NrOfEntries", report)
    if modules:
        raise report.refusal(
            section.name,
            "NrOfEntries",
            f"a modular device of up to {modules} kinds of module; the file does not list the "
            "modules in use. Export the EDS or DCF of your combination with the maker's tool",
        )


def _add_bindings(sheet: Sheet) -> None:
    """Copy the keys that lines of [Comments] give to objects into the objects' sections."""
    for match in filter(None, map(BINDING.match, sheet.get("Comments").keys.values())):
        if match[1] in sheet:
            for pair in match[2].split():
                key, _, text = pair.partition("=")
                sheet.get(match[1]).set(key, text)


def _dummies(sheet: Sheet, report: Report) -> list[Entry]:
    """Return the data types that an RPDO may map in place of objects."""
    usage = sheet.get("DummyUsage")
    names = [(code, f"Dummy{code:04d}") for code in DUMMY_TYPES]
    used = [(code, name) for code, name in names if number(usage, name, report)]
    return [Entry(code, 0, name, DATA_TYPES[code], "const") for code, name in used]


def _check_indices(sheet: Sheet, indices: set[int], report: Report) -> None:
    missing = [f"0x{index:04X}" for index in MANDATORY_OBJECTS if index not in indices]
    if missing:
        raise UserError(
            f"{report.source} lacks the mandatory object(s) {', '.join(missing)}; "
            "CiA 301 requires 0x1000 and 0x1001 in every device"
        )
    if IDENTITY not in indices:
        report.note("1018", "", "missing; CiA 301 requires an identity, LSS takes it as 0")
    for name in _LISTS:
        section = sheet.get(name)
        keys = [key for key in section.keys if key.isdigit()]
        listed = [number(section, key, report) for key in keys]
        absent = [f"0x{index:04X}" for index in listed if index not in indices]
        if absent:
            report.note(section.name, "", f"lists what is not described: {', '.join(absent)}")
