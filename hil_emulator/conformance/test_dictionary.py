"""Chapter 4: the dictionary against its EDS (CiA 306)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import OPERATIONAL, Device
from hil_emulator.conformance.expectation import (
    REFUSE_READ,
    REFUSE_WRITE,
    encoded,
    type_code,
    where,
)
from hil_emulator.conformance.parameters import beyond, free, free_parameters
from hil_emulator.device.entry import Entry

NO_DATA = 0x0800_0024
READ_ONLY = {0x0601_0000, 0x0601_0002, 0x0800_0000}
WRITE_ONLY = {0x0601_0000, 0x0601_0001, 0x0800_0000}
NO_SUCH_SUBINDEX = {0x0609_0011, 0x0800_0000}
OUT_OF_RANGE = {0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0800_0000}
STRUCTURE = 0xFF
ERROR_HISTORY = 0x1003


def check_access(device: Device) -> None:
    """Check that readable objects can be read, and writable objects written with their value."""
    for (index, subindex), variable in device.eds.variables.items():
        if not variable.readable or device.eds.flags(variable) & REFUSE_READ:
            continue
        code = device.sdo.read_code(index, subindex)
        allowed = (0, NO_DATA) if index == ERROR_HISTORY else (0,)
        assert code in allowed, f"{where(variable)}: reading aborts with {code:08X}"
    device.stop_sync()
    for variable in free_parameters(device.eds):
        check_write_back(device, variable)


def check_write_back(device: Device, variable: Entry) -> None:
    """Check that an object accepts its present value."""
    if device.eds.flags(variable) & (REFUSE_READ | REFUSE_WRITE):
        return
    value = device.sdo.upload(variable.index, variable.subindex)
    code = device.sdo.write_code(variable.index, variable.subindex, value)
    assert code == 0, f"{where(variable)}: writing back {value.hex()} aborts with {code:08X}"


def check_defaults(device: Device) -> None:
    """Check that parameters have the defaults of the EDS; process data are not checked."""
    for variable in device.eds.find({"const", "ro", "rw"}, mappable=False):
        expected = device.eds.default(variable)
        skipped = device.eds.flags(variable) & REFUSE_READ or variable.index == ERROR_HISTORY
        if expected is not None and not skipped:
            value = device.sdo.upload(variable.index, variable.subindex)
            assert value == expected, f"{where(variable)}: {value.hex()}, not {expected.hex()}"


@case("4.1")
def test_access_follows_the_eds(device: Device) -> None:
    """In PRE-OPERATIONAL every object can be read or written as its access type allows."""
    check_access(device)


@case("4.2")
def test_defaults_are_those_of_the_eds(device: Device) -> None:
    """After a reset the parameters have their defaults."""
    check_defaults(device)


@case("4.3")
def test_read_only_objects_refuse_writes(device: Device) -> None:
    """Objects that are ro or const abort a write of the right length."""
    for variable in device.eds.find({"ro", "const"}):
        data = bytes(variable.type.size or 1)
        code = device.sdo.write_code(variable.index, variable.subindex, data)
        assert code in READ_ONLY, f"{where(variable)}: writing ends with {code:08X}"


@case("4.4")
def test_write_only_objects_refuse_reads(device: Device) -> None:
    """Objects abort a read exactly if they are wo."""
    for (index, subindex), variable in device.eds.variables.items():
        code = device.sdo.read_code(index, subindex)
        allowed = WRITE_ONLY if variable.access == "wo" else {0, NO_DATA}
        assert code in allowed, f"{where(variable)}: reading ends with {code:08X}"


@case("4.5")
def test_structure_is_that_of_the_eds(device: Device) -> None:
    """Sub-index 255 shows data type and object type, or is absent as in the EDS."""
    for index in device.eds.indices():
        variable = device.eds.variables.get((index, STRUCTURE))
        if variable is None:
            assert device.sdo.read_code(index, STRUCTURE) in NO_SUCH_SUBINDEX, f"{index:04X}"
            continue
        value = device.sdo.read(index, STRUCTURE)
        assert value & 0xFF == device.eds.object_type(index), where(variable)
        member = device.eds.variables.get((index, 1)) or device.eds.variables[index, 0]
        assert value >> 8 in (type_code(member.type), 0), where(variable)


@case("4.6")
def test_limits_are_those_of_the_eds(device: Device) -> None:
    """A value beyond either limit is refused, and the object's present value is accepted."""
    device.stop_sync()
    for above in (True, False):
        for variable, value in beyond(device.eds, above=above):
            data = encoded(variable, value)
            code = device.sdo.write_code(variable.index, variable.subindex, data)
            assert code in OUT_OF_RANGE, f"{where(variable)}: {value} ends with {code:08X}"
            check_write_back(device, variable)


@case("4.7")
def test_access_is_the_same_in_operational(device: Device) -> None:
    """In OPERATIONAL every object can be read or written as its access type allows."""
    device.enter(OPERATIONAL)
    check_access(device)


@case("4.8")
def test_defaults_are_untouched_by_operational(device: Device) -> None:
    """After the start the device still has its defaults."""
    device.enter(OPERATIONAL)
    check_defaults(device)


@case("4.9")
def test_parameters_are_given_back_in_operational(device: Device) -> None:
    """In OPERATIONAL a parameter keeps the value written to it."""
    device.stop_sync()
    device.enter(OPERATIONAL)
    for variable in device.eds.find({"rw"}, mappable=False):
        if not free(variable) or device.eds.flags(variable) & (REFUSE_READ | REFUSE_WRITE):
            continue
        value = device.sdo.upload(variable.index, variable.subindex)
        check_write_back(device, variable)
        assert device.sdo.upload(variable.index, variable.subindex) == value, where(variable)
