"""Readings as whole numbers of digits, packed into bytes as a digital instrument does."""

from typing import Any

COUNT, TIME = -1, -2
"""Instead of a channel: the number of the sample, and its time."""

WORD_LENGTH = 6
"""Numbers that describe a word of a record, see `pack`."""

NOT_FINITE = 1 << 40
"""Instead of a range code: there was no sample. No number of channels has such a code."""


def digitise(value: float, low: float, high: float) -> int:
    """Return a number of digits, halves to even, within bounds; NaN becomes the lowest."""
    if low <= value <= high:
        return round(value)
    return int(high if value > high else low)


def pack(reading: Any, count: int, time: int, words: Any, record: Any) -> None:
    """Fill a record with readings in digits.

    Args:
        reading: what the sensors report, shape (channels,).
        count: number of the sample.
        time: its time.
        words: what stands where, shape (words, 6): channel, size of a digit, lowest and highest
            number of digits, first byte, bytes. For `COUNT` and `TIME` the lowest is what is added
            to them, the highest the mask of bits that are left. All are numbers that float64 holds
            exactly.
        record: bytes, the least significant of each word first; overwritten.

    """
    for i in range(len(words)):
        source, low, high = int(words[i, 0]), words[i, 2], words[i, 3]
        if source < 0:
            word = ((count if source == COUNT else time) + int(low)) & int(high)
        else:
            word = digitise(reading[source] / words[i, 1], low, high)
        first = int(words[i, 4])
        for k in range(int(words[i, 5])):
            record[first + k] = (word >> 8 * k) & 0xFF


def range_code(overrange: Any) -> int:
    """Return which channels are at which end of their range as one number, 0 with none at any."""
    code = 0
    for i in range(len(overrange)):
        code = 3 * code + overrange[i]
    return code


DIGITS = (digitise, pack, range_code)
"""What `kernel` compiles of this file."""
