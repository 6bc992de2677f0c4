"""Reading the device's parameters before the first case, and writing them back at the end."""

from collections.abc import Mapping

from hil_emulator.conformance.device import (
    CYCLE_PERIOD,
    EMCY_COB_ID,
    RESTORE_PARAMETERS,
    SAVE,
    STORE_PARAMETERS,
    SYNC_OVERFLOW,
    Device,
)
from hil_emulator.conformance.parameters import COMMANDS
from hil_emulator.conformance.pdo import COB_ID, INVALID, RPDO_RECORDS, TPDO_RECORDS, Pdo, pdos

Values = Mapping[tuple[int, int], bytes]

_PDO_OBJECTS = range(RPDO_RECORDS.start, TPDO_RECORDS.stop + 0x200)


def parameters(device: Device) -> Values:
    """Return all parameters that a client can write and read back."""
    variables = device.eds.find({"rw"}, mappable=False)
    keys = [(v.index, v.subindex) for v in variables if v.index not in COMMANDS]
    return {key: device.sdo.upload(*key) for key in keys if device.sdo.read_code(*key) == 0}


def forget_stored(device: Device, kept: Values) -> None:
    """Restore the stored defaults; if the device cannot restore them, store `kept`."""
    if device.eds.writable(RESTORE_PARAMETERS, 1):
        device.restore_defaults()
    else:
        put_back(device, kept)


def put_back(device: Device, kept: Values) -> None:
    """Write and store the parameters that the device had before the first case."""
    device.reset()  # a case may have left it in STOPPED, without SDO
    device.restore_defaults()
    now = parameters(device)
    different = {key: value for key, value in kept.items() if now.get(key) != value}
    if not different:
        return
    for pdo in pdos(device):
        if any(index in (pdo.index, pdo.mapping) for index, _ in different):
            _put_back_pdo(device, pdo, kept)
    if device.eds.writable(EMCY_COB_ID):
        device.sdo.write(EMCY_COB_ID, 0, device.sdo.read(EMCY_COB_ID) | INVALID, 4)
        different[EMCY_COB_ID, 0] = kept[EMCY_COB_ID, 0]
    if (SYNC_OVERFLOW, 0) in different:
        device.prepare_sync()
        different[CYCLE_PERIOD, 0] = kept[CYCLE_PERIOD, 0]
    for (index, subindex), value in sorted(different.items(), key=lambda item: _order(item[0])):
        if index not in _PDO_OBJECTS:
            device.sdo.write_code(index, subindex, value)
    if device.eds.writable(STORE_PARAMETERS, 1):
        device.sdo.download(STORE_PARAMETERS, 1, SAVE)
    device.reset()


def _order(key: tuple[int, int]) -> tuple[bool, tuple[int, int]]:
    """Sort the SYNC cycle period last, because it locks other parameters."""
    return key[0] == CYCLE_PERIOD, key


def _put_back_pdo(device: Device, pdo: Pdo, kept: Values) -> None:
    """Write the records of a PDO in the order required by CiA 301 7.5.2.36."""
    pdo.disable()
    entries = [value for (index, n), value in kept.items() if index == pdo.mapping and n]
    count = kept.get((pdo.mapping, 0))
    if count is not None:
        words = [int.from_bytes(entry, "little") for entry in entries[: count[0]]]
        pdo.map(words)
    for (index, subindex), value in kept.items():
        if index == pdo.index and subindex > COB_ID:
            device.sdo.write_code(index, subindex, value)
    if (pdo.index, COB_ID) in kept:
        device.sdo.write_code(pdo.index, COB_ID, kept[pdo.index, COB_ID])
