"""Short forms of an EDS (CiA 306): members of arrays, and whole PDOs.

`CompactSubObj=n` describes members 1 to n in one section; `[1016Value]` and `[1016Name]` give some
of them values and names. `CompactPDO` lists the members of the communication records of PDOs
without a section, up to `NrOfRXPDO` and `NrOfTXPDO`. Both are expanded here into sections.
"""

from collections.abc import Iterator

from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import Section, Sheet
from hil_emulator.device.eds.values import integer
from hil_emulator.device.pdo_records import (
    MAX_BITS,
    MAX_PDOS,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
)

ERROR_FIELD = 0x1003

_PDO_RANGES = (
    ("NrOfRXPDO", RPDO_COMMUNICATION, RPDO_MAPPING),
    ("NrOfTXPDO", TPDO_COMMUNICATION, TPDO_MAPPING),
)
_COMMUNICATION = (
    ("COB-ID", 7, ""), ("Transmission type", 5, "0xFF"), ("Inhibit time", 6, "0"),
    ("Compatibility entry", 5, "0"), ("Event timer", 6, "0"), ("SYNC start value", 5, "0"),
)  # fmt: skip
"""Name, data type and default of each member of a PDO communication record (CiA 301 7.5.2.35)."""


def number(section: Section, key: str, report: Report) -> int:
    """Return the number of a key of the file's structure; 0 if the key is missing.

    Raises:
        UserError: the text is not a number.

    """
    text = section.get(key)
    if not text:
        return 0
    try:
        parsed = integer(text)
    except ValueError:
        raise report.refusal(section.name, key, f"{text!r} is not a number") from None
    if parsed.odd:
        report.note(section.name, key, parsed.odd)
    return int(parsed.value)


def members(sheet: Sheet, section: Section, report: Report) -> Iterator[tuple[int, Section]]:
    """Yield the members that `CompactSubObj` stands for, by sub-index.

    Raises:
        UserError: it is not a number from 0 to 254.

    """
    count = number(section, "CompactSubObj", report)
    if not 0 <= count <= 254:
        raise report.refusal(section.name, "CompactSubObj", f"{count} is not 0 to 254")
    if not count:
        return
    index, values = section.name[:4], sheet.get(section.name[:4] + "Value")
    names = sheet.get(section.name[:4] + "Name")
    yield 0, _count(section, count, values)
    for sub in range(1, count + 1):
        member = Section(f"{index}sub{sub:X}", section.keys)
        member.set("ParameterName", names.get(str(sub)) or f"{section.get('ParameterName')}{sub}")
        if values.get(str(sub)):
            member.set("ParameterValue", values.get(str(sub)))
        yield sub, member


def _count(section: Section, count: int, values: Section) -> Section:
    """Return sub-index 0: the number of members, or of those in use where a master writes it."""
    keys = {"ParameterName": "Highest sub-index supported", "DataType": "5", "AccessType": "const"}
    keys["DefaultValue"] = str(count)
    if _counts_entries(int(section.name[:4], 16)):
        keys |= {"AccessType": "rw", "DefaultValue": values.get("NrOfEntries") or "0"}
    return Section(f"{section.name[:4]}sub0", keys)


def _counts_entries(index: int) -> bool:
    mappings = [range(first, first + MAX_PDOS) for _, _, first in _PDO_RANGES]
    return index == ERROR_FIELD or any(index in mapping for mapping in mappings)


def add_pdos(sheet: Sheet, report: Report) -> None:
    """Add the PDOs that `CompactPDO` stands for."""
    info = sheet.get("DeviceInfo")
    kept = number(info, "CompactPDO", report)
    if not kept:
        return
    for key, communication, mapping in _PDO_RANGES:
        for pdo in range(min(number(info, key, report), MAX_PDOS)):
            if f"{communication + pdo:04X}" not in sheet:
                _add_communication(sheet, f"{communication + pdo:04X}", kept)
            if f"{mapping + pdo:04X}" not in sheet:
                keys = {"ParameterName": "PDO mapping parameter", "ObjectType": "9"}
                keys |= {"DataType": "7", "AccessType": "rw", "CompactSubObj": str(MAX_BITS)}
                sheet.add(Section(f"{mapping + pdo:04X}", keys))


def _add_communication(sheet: Sheet, index: str, kept: int) -> None:
    values = sheet.get(index + "Value")
    highest = min(kept.bit_length(), len(_COMMUNICATION))
    keys = {"ParameterName": "PDO communication parameter", "ObjectType": "9"}
    sheet.add(Section(index, keys))
    count = {"ParameterName": "Highest sub-index supported", "DataType": "5", "AccessType": "const"}
    sheet.add(Section(f"{index}sub0", {**count, "DefaultValue": str(highest)}))
    for sub, (name, data_type, default) in enumerate(_COMMUNICATION[:highest], 1):
        if kept >> (sub - 1) & 1:
            keys = {"ParameterName": name, "DataType": str(data_type), "AccessType": "rw"}
            keys |= {"DefaultValue": default, "ParameterValue": values.get(str(sub))}
            sheet.add(Section(f"{index}sub{sub:X}", keys))
