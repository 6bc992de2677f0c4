"""Chapter 8: storing and restoring (CiA 301 7.5.2.13, 7.5.2.14), restricted identifiers (7.3.5)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object, need_writable
from hil_emulator.conformance.device import (
    EMCY_COB_ID,
    HEARTBEAT_PRODUCER,
    LOAD,
    RESTORE_PARAMETERS,
    SAVE,
    STORE_PARAMETERS,
    SYNC_COB_ID,
    Device,
)
from hil_emulator.conformance.pdo import COB_ID, INVALID, pdos

VERIFY_CONFIGURATION = 0x1020
WRONG = b"evas"
NOT_STORED = {0x0800_0020, 0x0800_0021, 0x0800_0022, 0x0800_0000, 0x0609_0030}
INVALID_VALUE = {0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0800_0000}
KEPT_MS = 4321
ALL, COMMUNICATION = 1, 2
RESTRICTED = (0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF,
              0x701, 0x77F, 0x780, 0x7FF)  # fmt: skip
"""First and last identifier of each restricted range."""


def check_refused(device: Device, index: int, subindex: int) -> None:
    """Check that a wrong signature and a missing signature are refused."""
    need_writable(device, index, subindex)
    for signature in (WRONG, bytes(4)):
        assert device.sdo.write_code(index, subindex, signature) in NOT_STORED, signature


def save(device: Device, subindex: int) -> int:
    """Change the heartbeat time and save it; return its default."""
    need_writable(device, STORE_PARAMETERS, subindex)
    need_writable(device, HEARTBEAT_PRODUCER)
    before = device.sdo.read(HEARTBEAT_PRODUCER)
    device.sdo.write(HEARTBEAT_PRODUCER, 0, KEPT_MS, 2)
    device.sdo.download(STORE_PARAMETERS, subindex, SAVE)
    device.reset()
    assert device.sdo.read(HEARTBEAT_PRODUCER) == KEPT_MS, "the saved value is lost"
    return before


def check_restored(device: Device, subindex: int) -> None:
    """Check that restoring sets the default at the next reset, not before."""
    need_writable(device, RESTORE_PARAMETERS, subindex)
    before = save(device, subindex)
    device.sdo.download(RESTORE_PARAMETERS, subindex, LOAD)
    assert device.sdo.read(HEARTBEAT_PRODUCER) == KEPT_MS, "restored before the reset"
    device.reset()
    assert device.sdo.read(HEARTBEAT_PRODUCER) == before


@case("8.1")
def test_saving_needs_the_signature(device: Device) -> None:
    """0x1010:01 refuses any value but "save"."""
    check_refused(device, STORE_PARAMETERS, ALL)


@case("8.2")
def test_saved_parameters_survive(storing: Device) -> None:
    """Values saved by 0x1010:01 are kept over reset node."""
    save(storing, ALL)


@case("8.3")
def test_restoring_needs_the_signature(device: Device) -> None:
    """0x1011:01 refuses any value but "load"."""
    check_refused(device, RESTORE_PARAMETERS, ALL)


@case("8.4")
def test_defaults_are_restored(storing: Device) -> None:
    """After "load" to 0x1011:01 and a reset, the parameter has its default."""
    check_restored(storing, ALL)


@case("8.5")
def test_saving_communication_needs_the_signature(device: Device) -> None:
    """0x1010:02 refuses any value but "save"."""
    check_refused(device, STORE_PARAMETERS, COMMUNICATION)


@case("8.6")
def test_saved_communication_parameters_survive(storing: Device) -> None:
    """Values saved by 0x1010:02 are kept over reset node."""
    save(storing, COMMUNICATION)


@case("8.7")
def test_restoring_communication_needs_the_signature(device: Device) -> None:
    """0x1011:02 refuses any value but "load"."""
    check_refused(device, RESTORE_PARAMETERS, COMMUNICATION)


@case("8.8")
def test_communication_defaults_are_restored(storing: Device) -> None:
    """After "load" to 0x1011:02 and a reset, the parameter has its default."""
    check_restored(storing, COMMUNICATION)


@case("8.9")
def test_configuration_date_is_kept(storing: Device) -> None:
    """0x1020, saved, is kept over reset node, and becomes 0 when a parameter changes."""
    need_object(storing, VERIFY_CONFIGURATION)
    need_writable(storing, STORE_PARAMETERS, ALL)
    date, time = 15_000, 43_200_000
    storing.sdo.write(VERIFY_CONFIGURATION, 1, date, 4)
    storing.sdo.write(VERIFY_CONFIGURATION, 2, time, 4)
    storing.sdo.download(STORE_PARAMETERS, ALL, SAVE)
    storing.reset()
    assert storing.sdo.read(VERIFY_CONFIGURATION, 1) == date
    assert storing.sdo.read(VERIFY_CONFIGURATION, 2) == time
    storing.sdo.write(HEARTBEAT_PRODUCER, 0, KEPT_MS, 2)
    assert storing.sdo.read(VERIFY_CONFIGURATION, 1) == 0


@case("8.10")
def test_restricted_identifiers_are_refused(device: Device) -> None:
    """PDO, SYNC and EMCY refuse restricted identifiers."""
    objects = [(pdo.index, COB_ID) for pdo in pdos(device)] + [(SYNC_COB_ID, 0), (EMCY_COB_ID, 0)]
    writable = [key for key in objects if device.eds.writable(*key)]
    for key in writable:
        if key[0] != SYNC_COB_ID:  # bit 31 of SYNC is not used
            device.sdo.write(*key, device.sdo.read(*key) | INVALID, 4)
        for can_id in RESTRICTED:
            code = device.sdo.write_code(*key, can_id.to_bytes(4, "little"))
            assert code in INVALID_VALUE, f"{key[0]:04X}: {can_id:03X} ends with {code:08X}"
