"""Numbers and values as EDS files write them.

An integer is decimal, hexadecimal (0x) or octal (a leading 0), and may be a sum with $NODEID
(CiA 306). Signed values are often written as the hexadecimal digits of their two's complement.
Files of makers also have C suffixes, a trailing h, `1.0`, or a remark behind `#`; such a number is
accepted, with a remark.
"""

import math
import re
import struct
from typing import Any, NamedTuple

from hil_emulator.device.datatype import DataType

_TERM = re.compile(r"([+-]?)(\$NODEID|0X-?[0-9A-F]+|[0-9]+)")
_SUFFIX = re.compile(r"(?<=[0-9A-F])U?L{0,2}$")
_WORDS = {"TRUE": "1", "FALSE": "0"}


class Value(NamedTuple):
    """A value, whether it contains the node-ID, and the deviation of its text ("" if correct)."""

    value: Any
    relative: bool = False
    odd: str = ""


def integer(text: str, node_id: int = 0) -> Value:
    """Return the integer that a text represents.

    Args:
        text: the text.
        node_id: replaces $NODEID.

    Raises:
        ValueError: the text is not an integer.

    """
    plain = re.sub(r"\s+", "", text.partition("#")[0]).upper()
    odd = "a remark behind the value" if "#" in text else ""
    try:
        return Value(*_sum(plain, node_id), odd)
    except ValueError:
        pass
    return Value(*_sum(_regular(plain), node_id), f"{text!r} is not a number of CiA 306")


def _regular(plain: str) -> str:
    """Return a number of another notation in the notation of CiA 306."""
    if plain in _WORDS:
        return _WORDS[plain]
    if re.fullmatch(r"[0-9A-F]+H", plain):
        return "0X" + plain[:-1]
    if re.fullmatch(r"-?[0-9]+\.0*", plain):
        return plain.partition(".")[0]
    if re.fullmatch(r"0[0-9]+", plain):
        return plain.lstrip("0") or "0"
    return _SUFFIX.sub("", plain)


def _sum(text: str, node_id: int) -> tuple[int, bool]:
    """Return the sum of the terms, and whether $NODEID is one of them."""
    total, at, relative = 0, 0, False
    for term in _TERM.finditer(text):
        sign, number = term.groups()
        if term.start() != at or (at and not sign):
            break
        at = term.end()
        relative |= number == "$NODEID"
        magnitude = node_id if number == "$NODEID" else _magnitude(number)
        total += -magnitude if sign == "-" else magnitude
    if not at or at != len(text):
        raise ValueError(f"{text!r} is not a number")
    return total, relative


def _magnitude(number: str) -> int:
    if number.startswith("0X"):
        return int(number[2:], 16)
    return int(number, 8 if number.startswith("0") else 10)


def value(text: str, data_type: DataType, node_id: int) -> Value:
    """Return a value of a data type.

    Args:
        text: as the file has it, not empty.
        data_type: what it is to be.
        node_id: replaces $NODEID.

    Raises:
        ValueError: the text is not a value of this type.
        OverflowError: the value exceeds the range of the type.

    """
    if data_type.kind == "bytes":
        return _bytes(text, data_type)
    if data_type.kind == "real":
        number = Value(_real(text, data_type))
    else:
        number = integer(text, node_id)
        if data_type.low < 0 and data_type.high < number.value < 1 << data_type.bits:
            number = number._replace(value=number.value - (1 << data_type.bits))
    if not data_type.low <= number.value <= data_type.high:
        raise OverflowError(f"{text!r} does not fit")
    return number


def _real(text: str, data_type: DataType) -> float:
    """Return a decimal number, or the one whose bytes are written in hexadecimal (CiA 306)."""
    if text[:2].upper() == "0X":
        digits = int(text, 16).to_bytes(data_type.size, "big")
        (number,) = struct.unpack(">" + data_type.struct_code, digits)
    else:
        number = float(text.replace(",", "."))
    if not math.isfinite(number):
        raise ValueError(f"{text!r} is not finite")
    return float(number)


def _bytes(text: str, data_type: DataType) -> Value:
    """Return the bytes of a string, or those that are written in hexadecimal."""
    if data_type.name == "UNICODE_STRING":
        return Value(text.encode("utf-16-le"))
    if data_type.name != "VISIBLE_STRING":
        try:
            return Value(bytes.fromhex(text))
        except ValueError:
            if data_type.name == "DOMAIN":
                raise
    odd = "" if data_type.name == "VISIBLE_STRING" else f"{text!r} is not hexadecimal; its letters"
    try:
        return Value(text.encode("latin-1"), odd=odd)
    except UnicodeEncodeError:
        return Value(text.encode(), odd=odd)
