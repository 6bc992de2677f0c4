"""Chapter 2, first part: expedited transfers and their aborts (CiA 301 7.2.4)."""

import random

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import NO_SUCH_OBJECT
from hil_emulator.conformance.device import Device
from hil_emulator.conformance.expectation import encoded, where
from hil_emulator.conformance.parameters import COMMUNICATION, beyond, free_parameters, numbers
from hil_emulator.device.entry import Entry

GENERAL = 0x0800_0000
READ_ONLY = {0x0601_0000, 0x0601_0002, GENERAL}
WRITE_ONLY = {0x0601_0000, 0x0601_0001, GENERAL}
NO_SUCH_SUBINDEX = {0x0609_0011, GENERAL}
UNKNOWN_COMMAND = {0x0504_0001, GENERAL}
TOO_LONG = {0x0607_0010, 0x0607_0012, GENERAL}
TOO_SHORT = {0x0607_0010, 0x0607_0013, GENERAL}
TOO_HIGH = {0x0609_0030, 0x0609_0031, GENERAL}
TOO_LOW = {0x0609_0030, 0x0609_0032, GENERAL}

ORDER_SEED = 301


@case("2.1")
def test_device_type_is_answered_in_one_frame(device: Device) -> None:
    """The answer is expedited and holds the value of the EDS."""
    answer = device.sdo.initiate_upload(0x1000)
    assert answer[0] & 0x02, f"{answer.hex()} is not an expedited answer"
    expected = device.eds.default(device.eds.variables[0x1000, 0])
    assert expected in (None, answer[4:])


@case("2.2")
def test_communication_parameters_are_given_back(device: Device) -> None:
    """Each parameter, in random order, accepts its present value and keeps it."""
    device.stop_sync()
    parameters = free_parameters(device.eds, COMMUNICATION)
    random.Random(ORDER_SEED).shuffle(parameters)
    for variable in parameters:
        value = device.sdo.upload(variable.index, variable.subindex)
        code = device.sdo.write_code(variable.index, variable.subindex, value)
        assert code == 0, f"{where(variable)}: writing back {value.hex()} aborts with {code:08X}"
        assert device.sdo.upload(variable.index, variable.subindex) == value, where(variable)


@case("2.3")
def test_device_type_is_read_only(device: Device) -> None:
    """A write is refused and does not change the value."""
    before = device.sdo.upload(0x1000)
    assert device.sdo.write_code(0x1000, 0, bytes(4)) in READ_ONLY
    assert device.sdo.upload(0x1000) == before


@case("2.4")
def test_write_only_objects_are_not_read(device: Device) -> None:
    """Only objects that are write-only in the EDS refuse a read as write-only."""
    refusing = {
        key
        for key, variable in device.eds.variables.items()
        if device.sdo.read_code(*key) == 0x0601_0001 or variable.access == "wo"
    }
    for key in refusing:
        assert device.eds.variables[key].access == "wo", f"{key} refuses to be read"
        assert device.sdo.read_code(*key) in WRITE_ONLY


@case("2.5")
def test_absent_subindex_is_refused(device: Device) -> None:
    """Device type has no sub-index 1."""
    assert device.sdo.read_code(0x1000, 1) in NO_SUCH_SUBINDEX


@case("2.6")
def test_absent_object_is_refused(device: Device) -> None:
    """Object 0x1004 is reserved."""
    assert device.sdo.read_code(0x1004) in NO_SUCH_OBJECT


@case("2.7")
def test_unknown_command_is_refused(device: Device) -> None:
    """The command specifier 7 is not defined and is refused."""
    assert device.sdo.aborts(bytes.fromhex("e0001000")) in UNKNOWN_COMMAND
    assert device.sdo.read_code(0x1000) == 0


@case("2.8")
def test_too_long_data_are_refused(device: Device) -> None:
    """Four bytes for an object of one or two bytes are refused."""
    for variable in numbers(device.eds, 1, 2):
        _refuses(device, variable, bytes(4), TOO_LONG)


@case("2.9")
def test_too_short_data_are_refused(device: Device) -> None:
    """One byte for an object of two bytes is refused, and one to three bytes for four."""
    for variable in numbers(device.eds, 2, 4):
        for size in range(1, variable.type.size):
            _refuses(device, variable, bytes(size), TOO_SHORT)


@case("2.10")
def test_too_high_values_are_refused(device: Device) -> None:
    """The highest value plus 1 is refused."""
    device.stop_sync()
    for variable, value in beyond(device.eds, above=True):
        _refuses(device, variable, encoded(variable, value), TOO_HIGH)


@case("2.11")
def test_too_low_values_are_refused(device: Device) -> None:
    """The lowest value minus 1 is refused."""
    device.stop_sync()
    for variable, value in beyond(device.eds, above=False):
        _refuses(device, variable, encoded(variable, value), TOO_LOW)


@case("2.12")
def test_predefined_identifiers_are_used(device: Device) -> None:
    """0x1200, if it exists, has the identifiers that this case uses."""
    for subindex, base in ((1, 0x600), (2, 0x580)):
        if (0x1200, subindex) in device.eds:
            assert device.sdo.read(0x1200, subindex) == base + device.node_id
        else:
            assert device.sdo.read_code(0x1200, subindex) in NO_SUCH_OBJECT


def _refuses(device: Device, variable: Entry, data: bytes, codes: set[int]) -> None:
    """Check that a write aborts with one of some codes and does not change the object."""
    key = variable.index, variable.subindex
    before = device.sdo.upload(*key)
    code = device.sdo.write_code(*key, data)
    assert code in codes, f"{where(variable)}: writing {data.hex()} ends with {code:08X}"
    assert device.sdo.upload(*key) == before, f"{where(variable)} has changed"
