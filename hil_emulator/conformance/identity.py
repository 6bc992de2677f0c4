"""Identity of the device for the head of a report."""

from datetime import datetime

from hil_emulator import __version__
from hil_emulator.conformance.device import Device

_STRINGS = {0x1008: "Device name", 0x1009: "Hardware version", 0x100A: "Software version"}
_NUMBERS = {1: "Vendor-ID", 2: "Product code", 3: "Revision number", 4: "Serial number"}


def about(device: Device) -> list[tuple[str, str]]:
    """Return titles and texts: device, EDS, time and version of the suite."""
    sdo, eds = device.sdo, device.eds
    rows = [("Node-ID", str(device.node_id)), ("EDS", eds.path.name)]
    for index, title in _STRINGS.items():
        if (index, 0) in eds and sdo.read_code(index) == 0:
            rows.append((title, sdo.upload(index).decode("latin-1")))
    for subindex, title in _NUMBERS.items():
        if (0x1018, subindex) in eds and sdo.read_code(0x1018, subindex) == 0:
            rows.append((title, f"0x{sdo.read(0x1018, subindex):08X}"))
    if device.self_starting:
        rows.append(("After boot-up", "OPERATIONAL by itself"))
    when = datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
    return [*rows, ("Tested", f"{when}, hil-emulator {__version__}")]
