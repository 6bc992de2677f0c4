"""The data types of CiA 301 7.4.7 and how their values look on the bus."""

import math
import struct
from dataclasses import dataclass
from typing import Any

from canopen.objectdictionary import datatypes as code

from hil_emulator.device.abort import AbortCode, SdoAbort

REAL32_MAX = (2.0 - 2.0**-23) * 2.0**127
"""Largest finite IEEE 754 single precision number."""


@dataclass(frozen=True, slots=True)
class DataType:
    """One data type.

    Attributes:
        name: as CiA 301 spells it.
        kind: "integer", "real" or "bytes" (strings and DOMAIN).
        bits: length in a PDO; 0 where the length is not fixed.
        low: smallest value of an integer or real type, for "bytes" 0.
        high: largest value of an integer or real type, for "bytes" 0.
        struct_code: the format character of `struct`, "" if `struct` has no such type.

    """

    name: str
    kind: str
    bits: int
    low: float
    high: float
    struct_code: str

    @property
    def size(self) -> int:
        """Length in an SDO, in bytes; 0 where it is not fixed."""
        return (self.bits + 7) // 8

    @property
    def numeric(self) -> bool:
        """Whether values are numbers rather than bytes."""
        return self.kind != "bytes"

    def encode(self, value: Any) -> bytes:
        """Return a value's bytes, least significant first.

        Raises:
            OverflowError: the number does not fit the type.

        """
        if self.kind == "integer":
            return int(value).to_bytes(self.size, "little", signed=self.low < 0)
        if self.kind == "real":
            return struct.pack("<" + self.struct_code, value)
        return bytes(value)

    def decode(self, data: bytes) -> Any:
        """Return the value of exactly as many bytes as the type has.

        Raises:
            SdoAbort: the length is wrong (0607 0012, 0607 0013), or a real number is not
                finite (0609 0030).

        """
        if self.kind == "bytes":
            return bytes(data)
        self.check_length(len(data))
        if self.kind == "real":
            (value,) = struct.unpack("<" + self.struct_code, data)
            if not math.isfinite(value):
                raise SdoAbort(AbortCode.INVALID_VALUE)
            return value
        return int.from_bytes(data, "little", signed=self.low < 0)

    def check_length(self, length: int) -> None:
        """Refuse a length in bytes that is not the type's (0607 0012, 0607 0013)."""
        if self.size and length > self.size:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        if length < self.size:
            raise SdoAbort(AbortCode.LENGTH_TOO_LOW)


def _signed(bits: int, struct_code: str = "") -> DataType:
    high = (1 << (bits - 1)) - 1
    return DataType(f"INTEGER{bits}", "integer", bits, -high - 1, high, struct_code)


def _unsigned(bits: int, struct_code: str = "", name: str = "") -> DataType:
    return DataType(name or f"UNSIGNED{bits}", "integer", bits, 0, (1 << bits) - 1, struct_code)


def _bytes(name: str) -> DataType:
    return DataType(name, "bytes", 0, 0, 0, "")


_REAL64_MAX = struct.unpack("<d", b"\xff\xff\xff\xff\xff\xff\xef\x7f")[0]

DATA_TYPES: dict[int, DataType] = {
    code.BOOLEAN: _unsigned(1, name="BOOLEAN"),
    code.INTEGER8: _signed(8, "b"),
    code.INTEGER16: _signed(16, "h"),
    code.INTEGER24: _signed(24),
    code.INTEGER32: _signed(32, "i"),
    code.INTEGER40: _signed(40),
    code.INTEGER48: _signed(48),
    code.INTEGER56: _signed(56),
    code.INTEGER64: _signed(64, "q"),
    code.UNSIGNED8: _unsigned(8, "B"),
    code.UNSIGNED16: _unsigned(16, "H"),
    code.UNSIGNED24: _unsigned(24),
    code.UNSIGNED32: _unsigned(32, "I"),
    code.UNSIGNED40: _unsigned(40),
    code.UNSIGNED48: _unsigned(48),
    code.UNSIGNED56: _unsigned(56),
    code.UNSIGNED64: _unsigned(64, "Q"),
    code.TIME_OF_DAY: _unsigned(48, name="TIME_OF_DAY"),
    code.TIME_DIFFERENCE: _unsigned(48, name="TIME_DIFFERENCE"),
    code.REAL32: DataType("REAL32", "real", 32, -REAL32_MAX, REAL32_MAX, "f"),
    code.REAL64: DataType("REAL64", "real", 64, -_REAL64_MAX, _REAL64_MAX, "d"),
    code.VISIBLE_STRING: _bytes("VISIBLE_STRING"),
    code.OCTET_STRING: _bytes("OCTET_STRING"),
    code.UNICODE_STRING: _bytes("UNICODE_STRING"),
    code.DOMAIN: _bytes("DOMAIN"),
}
"""Every data type an EDS may name, by its code (CiA 301 7.4.7)."""

BYTE_BOOLEAN = DataType("BOOLEAN", "integer", 8, 0, 1, "B")
"""A BOOLEAN that takes a byte in PDOs, as in CANopenNode and stacks derived from it."""
