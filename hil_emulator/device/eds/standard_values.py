"""Values that CiA 301 gives objects whose EDS gives none.

A COB-ID without a value, or of 0, would be NMT's. The predefined connection set has one for each
of the first four PDOs, for EMCY and for the SDO server; a further PDO does not exist until a master
says where. An identity without values is that of `[DeviceInfo]`.
"""

from collections.abc import Iterator

from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import Sheet
from hil_emulator.device.eds.values import integer
from hil_emulator.device.pdo_records import MAX_PDOS, RPDO_COMMUNICATION, TPDO_COMMUNICATION

PREDEFINED_PDOS = 4
NO_PDO = "0x80000000"
"""Bit 31 of a COB-ID: the PDO does not exist (CiA 301 7.5.2.35)."""

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
    """Give values to COB-IDs and to an identity that have none."""
    for name, cob_id in _cob_ids():
        if name in sheet and _zero(sheet, name):
            sheet.get(name).set("DefaultValue", cob_id)
            report.note(name, "DefaultValue", f"no COB-ID; {cob_id}")
    for subindex, key in _IDENTITY.items():
        name, text = f"1018sub{subindex}", sheet.get("DeviceInfo").get(key)
        if name in sheet and text and not (_text(sheet, name)):
            sheet.get(name).set("DefaultValue", text)
            report.note(name, "DefaultValue", f"missing; that of [DeviceInfo] {key}")


def _cob_ids() -> Iterator[tuple[str, str]]:
    yield from _COB_IDS.items()
    for first, base in _PDOS:
        for pdo in range(MAX_PDOS):
            predefined = f"$NODEID+0x{base + 0x100 * pdo:X}"
            yield f"{first + pdo:04X}sub1", predefined if pdo < PREDEFINED_PDOS else NO_PDO


def _text(sheet: Sheet, name: str) -> str:
    return sheet.get(name).get("ParameterValue") or sheet.get(name).get("DefaultValue")


def _zero(sheet: Sheet, name: str) -> bool:
    text = _text(sheet, name)
    try:
        return not text or not integer(text, 1).value & 0x7FF
    except ValueError:
        return False  # whoever reads the value, notes it
