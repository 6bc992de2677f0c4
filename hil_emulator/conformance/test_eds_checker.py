"""Chapter 1: the EDS itself (CiA 306)."""

import re

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import Device
from hil_emulator.conformance.expectation import FIRST_OBJECT, bits, type_range, where

LISTS = {
    "mandatoryobjects": range(0x1000, 0x1019),
    "optionalobjects": range(0x1001, 0x10000),
    "manufacturerobjects": range(0x2000, 0x6000),
}
ACCESS_TYPES = {"ro", "wo", "rw", "rwr", "rww", "const"}


@case("1.0")
def test_the_eds_is_sound(device: Device) -> None:
    """Lists and sections agree, defaults are in range, and counts are what they count."""
    eds = device.eds
    listed: list[int] = []
    sections = {name.lower(): name for name in eds.sections.sections()}
    for name, expected in LISTS.items():
        content = eds.sections[sections[name]] if name in sections else {}
        count = int(content.get("supportedobjects", "0"), 0)
        indices = [int(content[str(n)], 0) for n in range(1, count + 1)]
        assert all(index in expected for index in indices), f"[{name}] lists a wrong index"
        assert len([key for key in content if key.isdecimal()]) == count, f"[{name}] miscounts"
        listed += indices
    described = [int(s, 16) for s in sections if re.fullmatch(r"[0-9a-f]{4}", s)]
    described = [index for index in described if index >= FIRST_OBJECT]
    assert sorted(listed) == sorted(described), "listed and described objects differ"
    assert {0x1000, 0x1001, 0x1018} <= set(described), "a mandatory object is missing"
    _check_counts(device)
    for variable in eds.variables.values():
        _check_variable(variable)


def _check_counts(device: Device) -> None:
    information = device.eds.information
    rpdos = device.eds.indices(range(0x1400, 0x1600))
    tpdos = device.eds.indices(range(0x1800, 0x1A00))
    assert information.nr_of_RXPDO == len(rpdos), "NrOfRXPDO"
    assert information.nr_of_TXPDO == len(tpdos), "NrOfTXPDO"
    for index in (*rpdos, *tpdos):
        assert index + 0x200 in device.eds, f"{index:04X} has no mapping parameter"


def _check_variable(variable: object) -> None:
    access = variable.access_type  # type: ignore[attr-defined]
    assert access in ACCESS_TYPES, f"{where(variable)}: access type {access}"
    value, low, high = variable.default, variable.min, variable.max  # type: ignore[attr-defined]
    limits = type_range(variable)
    if limits is not None and value is not None:
        least, most = (limits[0] if low is None else low), (limits[1] if high is None else high)
        assert least <= value <= most, f"{where(variable)}: default {value} is out of range"
    if variable.pdo_mappable:  # type: ignore[attr-defined]
        assert 1 <= bits(variable) <= 64, f"{where(variable)}: mappable, but no PDO can hold it"
