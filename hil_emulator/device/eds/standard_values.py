"""Values of CiA 301 for objects without a value in the EDS.

A COB-ID without a value, or of 0, would be that of NMT. The predefined connection set has a COB-ID
for each of the first four PDOs, for EMCY and for the SDO server. A further PDO or SDO does not
exist until a master sets its COB-ID. A COB-ID of node 0, such as 0x180, lacks its $NODEID. The
default SDO server always has the COB-IDs of the node-ID. An identity without values is taken from
`[DeviceInfo]`.
"""

from collections.abc import Iterator

from hil_emulator.device.cob_id import CAN_ID_MASK, INVALID
from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import Section, Sheet
from hil_emulator.device.eds.values import Value, integer
from hil_emulator.device.pdo_records import MAX_PDOS, RPDO_COMMUNICATION, TPDO_COMMUNICATION
from hil_emulator.frame import EXTENDED

PREDEFINED_PDOS = 4
ABSENT = "0x80000000"
"""Bit 31 of a COB-ID: the PDO or SDO does not exist (CiA 301 7.5.2.33, 7.5.2.35)."""

SDO_SERVER = "1200"
FURTHER_SDOS = range(0x1201, 0x1300)
"""Servers and clients other than the default server: they do not exist until a master adds them."""

_COB_IDS = {
    "1005": "0x80",
    "1012": "0x100",
    "1014": "$NODEID+0x80",
    "1200sub1": "$NODEID+0x600",
    "1200sub2": "$NODEID+0x580",
}
"""Predefined connection set (CiA 301 7.3.5)."""
_PDOS = ((RPDO_COMMUNICATION, 0x200), (TPDO_COMMUNICATION, 0x180))
_IDENTITY = {1: "VendorNumber", 2: "ProductNumber", 3: "RevisionNumber"}


def fill(sheet: Sheet, report: Report) -> None:
    """Set missing values of COB-IDs and of the identity."""
    for name, predefined in _cob_ids():
        if name in sheet:
            _complete(sheet.get(name), predefined, report)
    for subindex, key in _IDENTITY.items():
        name, text = f"1018sub{subindex}", sheet.get("DeviceInfo").get(key)
        if name in sheet and text and not _text(sheet.get(name)):
            sheet.get(name).set("DefaultValue", text)
            report.note(name, "DefaultValue", f"missing; that of [DeviceInfo] {key}")


def _cob_ids() -> Iterator[tuple[str, str]]:
    yield from _COB_IDS.items()
    for index in FURTHER_SDOS:
        yield from ((f"{index:04X}sub{subindex}", ABSENT) for subindex in (1, 2))
    for first, base in _PDOS:
        for pdo in range(MAX_PDOS):
            predefined = f"$NODEID+0x{base + 0x100 * pdo:X}"
            yield f"{first + pdo:04X}sub1", predefined if pdo < PREDEFINED_PDOS else ABSENT


def _complete(section: Section, predefined: str, report: Report) -> None:
    """Set a missing COB-ID, or add the node-ID that its value lacks."""
    key = "ParameterValue" if section.get("ParameterValue") else "DefaultValue"
    text = section.get(key)
    try:
        given = integer(text) if text else Value(0)
    except ValueError:
        given = Value(0)
    if given.value & EXTENDED:
        return
    if predefined == ABSENT and given.value & INVALID:
        return
    if not given.value & CAN_ID_MASK and not given.relative:
        section.set(key, predefined)
        report.note(section.name, key, f"no COB-ID; {predefined}")
    elif "$NODEID" in predefined and not given.relative:
        base = integer(predefined).value
        if section.name[:4] == SDO_SERVER or given.value & CAN_ID_MASK == base:
            flags = given.value & ~CAN_ID_MASK
            section.set(key, f"$NODEID+0x{flags | base:X}")
            report.note(section.name, key, f"does not follow the node-ID; $NODEID+0x{base:X}")


def _text(section: Section) -> str:
    return section.get("ParameterValue") or section.get("DefaultValue")
