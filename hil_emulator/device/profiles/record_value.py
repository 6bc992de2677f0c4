"""Records of value, unit and prefix, which CiA 408 uses for every quantity."""

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry

VALUE, UNIT, PREFIX = 1, 2, 3
"""Sub-indices of such a record: INTEGER or UNSIGNED, UNSIGNED8, INTEGER8 as a power of ten."""

FULL_SCALE = 16384
"""Digits of 100 % in a record that is a fraction of the rated value (CiA 408)."""


def seconds(dictionary: Dictionary, index: int) -> float:
    """Return the time of a record [s], 0 if the EDS lacks the record."""
    entry = dictionary.number(index, VALUE)
    if entry is None:
        return 0.0
    prefix = dictionary.number(index, PREFIX)
    return float(entry.value) * 10.0 ** (0 if prefix is None else int(prefix.value))


def share(dictionary: Dictionary, index: int, missing: int) -> int:
    """Return a record's value in digits of 1/16384, `missing` if the EDS lacks the record."""
    entry = dictionary.number(index, VALUE)
    return missing if entry is None else int(entry.value)


def fraction(entry: Entry | None) -> float:
    """Return a factor coded as numerator in the upper and denominator in the lower word."""
    code = 0x0001_0001 if entry is None else int(entry.value)
    return (code >> 16) / ((code & 0xFFFF) or 1)
