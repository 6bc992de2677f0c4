"""Chapter 5: EMCY, error register and error history (CiA 301 7.2.7)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object
from hil_emulator.conformance.device import EMCY_COB_ID, Device
from hil_emulator.conformance.errors import provoke

ERROR_REGISTER, ERROR_HISTORY = 0x1001, 0x1003
GENERIC, RESERVED = 0x01, 0x40
NO_DATA = 0x0800_0024


@case("5.1")
def test_emergency_identifier(device: Device) -> None:
    """0x1014 is that of the predefined connection set, as in the EDS."""
    need_object(device, EMCY_COB_ID)
    value = device.sdo.upload(EMCY_COB_ID)
    assert value == device.eds.default(device.eds.variables[EMCY_COB_ID, 0])
    assert int.from_bytes(value, "little") == device.emergency_id


@case("5.2")
def test_error_register_is_consistent(device: Device) -> None:
    """The reserved bit is 0, and the generic bit is set with any other."""
    register = device.sdo.read(ERROR_REGISTER)
    assert not register & RESERVED
    assert register == 0 or register & GENERIC


@case("5.3")
def test_history_is_empty_after_a_reset(device: Device) -> None:
    """As many errors as 0x1003:00 counts can be read; where it is 0, the first has no data."""
    need_object(device, ERROR_HISTORY)
    count = device.sdo.read(ERROR_HISTORY)
    code = device.sdo.read_code(ERROR_HISTORY, 1)
    assert code == 0 if count else code in (0, NO_DATA)
    if count == 0 and code == 0:
        assert device.sdo.read(ERROR_HISTORY, 1) == 0


@case("5.4")
def test_error_is_reported(device: Device) -> None:
    """An error caused from the bus is told in an emergency of eight bytes."""
    assert len(provoke(device)) == 8


@case("5.5")
def test_error_is_shown_in_the_register(device: Device) -> None:
    """The emergency carries the error register, the same that can be read."""
    emergency = provoke(device)
    register = device.sdo.read(ERROR_REGISTER)
    assert register & GENERIC
    assert emergency[2] == register


@case("5.6")
def test_error_is_remembered(device: Device) -> None:
    """The newest error of the history has the code of the emergency."""
    need_object(device, ERROR_HISTORY)
    emergency = provoke(device)
    assert device.sdo.read(ERROR_HISTORY) >= 1
    assert device.sdo.upload(ERROR_HISTORY, 1)[:2] == emergency[:2]
