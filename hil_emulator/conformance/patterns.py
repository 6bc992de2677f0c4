"""Test values for objects that show the position of each byte."""

import struct

from hil_emulator.conformance.expectation import Expectation
from hil_emulator.conformance.parameters import APPLICATION
from hil_emulator.device.entry import Entry

_REAL_CODE = {4: "<f", 8: "<d"}


def pattern(variable: Entry, seed: int = 0) -> bytes:
    """Return the bytes of a value within the limits, all different if the limits allow it."""
    kind = variable.type
    low, high = variable.bounds
    if kind.kind == "real":
        wanted = 1.0 + 0.3 * (seed + 1)
        value = wanted if low <= wanted <= high else (low + high) / 2
        return struct.pack(_REAL_CODE[kind.size], value)
    number = int.from_bytes(bytes(range(seed + 1, seed + 1 + kind.size)), "little")
    if not low <= number <= high:
        number = int(low) + number % (int(high) - int(low) + 1)
    return number.to_bytes(kind.size, "little", signed=kind.low < 0)


def loops(eds: Expectation) -> list[Entry]:
    """Return the objects that a client may write and a TPDO may carry, the longest first."""
    variables = [
        v
        for v in eds.variables.values()
        if v.transmittable and v.writable and v.index in APPLICATION
    ]
    return sorted(
        (v for v in variables if v.readable and v.type.numeric and pattern(v, 0) != pattern(v, 1)),
        key=lambda v: -v.type.bits,
    )


def packed(variables: list[Entry], values: list[bytes]) -> bytes:
    """Return a PDO's data (CiA 301 7.5.2.36): the first object in the least significant bits."""
    word = start = 0
    for variable, value in zip(variables, values, strict=True):
        bits = variable.type.bits
        word |= (int.from_bytes(value, "little") & (1 << bits) - 1) << start
        start += bits
    return word.to_bytes((start + 7) // 8, "little")
