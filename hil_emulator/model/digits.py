"""Readings as whole numbers of digits, packed into bytes as a digital instrument does."""

from typing import Any

COUNT, TIME = -1, -2
"""Instead of a channel: the number of the sample, and its time."""

WORD_LENGTH = 6
"""Numbers that describe a word of a record, see `pack`."""

NOT_FINITE = 1 << 40
"""In place of a range code: there was no sample. The value is no valid range code."""


def digitise(value: float, low: float, high: float) -> int:
    """Return a number of digits, halves to even, within bounds; NaN becomes the lowest."""
    if low <= value <= high:
        return round(value)
    return int(high if value > high else low)


def pack(reading: Any, count: int, time: int, words: Any, record: Any) -> None:
    """Fill a record with readings in digits.

    Args:
        reading: readings of the sensors, shape (channels,).
        count: number of the sample.
        time: its time.
        words: layout of the record, shape (words, 6): channel, size of a digit, lowest and highest
            number of digits, first byte, number of bytes. For `COUNT` and `TIME` the lowest is
            added to them, and the highest is the mask of the sum. All numbers are exact in
            float64.
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
    """Return the range errors of all channels as one number, 0 if all are within their range."""
    code = 0
    for i in range(len(overrange)):
        code = 3 * code + overrange[i]
    return code


DIGITS = (digitise, pack, range_code)
"""What `kernel` compiles of this file."""
