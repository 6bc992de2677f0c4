"""Chapter 1: the EDS itself (CiA 306)."""

import re

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import Device
from hil_emulator.conformance.expectation import FIRST_OBJECT, Expectation, type_range, where
from hil_emulator.device.entry import Entry

LISTS = {
    "MandatoryObjects": range(0x1000, 0x1019),
    "OptionalObjects": range(0x1001, 0x10000),
    "ManufacturerObjects": range(0x2000, 0x6000),
}


@case("1.0")
def test_the_eds_is_sound(device: Device) -> None:
    """Lists and sections agree, defaults are in range, and counts are correct."""
    listed = [index for name in LISTS for index in _listed(device.eds, name)]
    names = [section.name for section in device.eds.sheet]
    described = [int(name, 16) for name in names if re.fullmatch(r"[0-9A-Fa-f]{4}", name)]
    described = [index for index in described if index >= FIRST_OBJECT]
    assert sorted(listed) == sorted(described), "listed and described objects differ"
    assert {0x1000, 0x1001, 0x1018} <= set(described), "a mandatory object is missing"
    _check_counts(device.eds)
    for variable in device.eds.variables.values():
        _check_variable(variable)


def _listed(eds: Expectation, name: str) -> list[int]:
    """Return the objects of a list, and check the number that the list states."""
    keys = eds.sheet.get(name).keys
    indices = [int(text, 0) for key, text in keys.items() if key.isdecimal()]
    count = int(eds.sheet.get(name).get("SupportedObjects") or "0", 0)
    assert len(indices) == count, f"[{name}] miscounts"
    assert all(index in LISTS[name] for index in indices), f"[{name}] lists a wrong index"
    return indices


def _check_counts(eds: Expectation) -> None:
    rpdos = eds.indices(range(0x1400, 0x1600))
    tpdos = eds.indices(range(0x1800, 0x1A00))
    assert eds.count("NrOfRXPDO") == len(rpdos), "NrOfRXPDO"
    assert eds.count("NrOfTXPDO") == len(tpdos), "NrOfTXPDO"
    for index in (*rpdos, *tpdos):
        assert index + 0x200 in eds, f"{index:04X} has no mapping parameter"


def _check_variable(variable: Entry) -> None:
    if type_range(variable) is not None:
        low, high = variable.bounds
        value = variable.default
        assert low <= value <= high, f"{where(variable)}: default {value} is out of range"
    if variable.mappable:
        width = variable.type.bits
        assert 1 <= width <= 64, f"{where(variable)}: mappable, but no PDO can hold it"
