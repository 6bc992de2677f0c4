"""How many bits a frame takes on the wire: stuff bits are those of its very bits (ISO 11898-1)."""

from collections.abc import Callable

from hil_emulator.frame import Frame

CRC_BITS = 15
CRC_POLYNOMIAL = 0x4599
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, initial value 0 (ISO 11898-1)."""
END_BITS = 10
"""CRC delimiter, ACK slot, ACK delimiter, and the seven bits of the end of frame."""
INTERMISSION_BITS = 3
"""Between a frame and the next."""

Length = Callable[[Frame], int]
"""Returns the bits of a frame up to its end, without the intermission."""

_STUFF_AFTER = 5
"""Equal bits after which one of the other value is put in."""
_BASE_BITS, _EXTENSION_BITS = 11, 18


def length(frame: Frame) -> int:
    """Return the bits of a frame from its start to its end, without the intermission."""
    bits, count = stuffed_field(frame)
    return count + stuff_bits(bits, count) + END_BITS


def stuffed_field(frame: Frame) -> tuple[int, int]:
    """Return what is subject to bit stuffing, start of frame to CRC, as a number, and its length.

    The first bit on the wire is the most significant one; dominant is 0.
    """
    if frame.extended:
        # identifier, SRR = 1, IDE = 1, identifier extension, RTR, two reserved bits
        base, extension = frame.can_id >> _EXTENSION_BITS, frame.can_id & 0x3FFFF
        head = (base << 2 | 0b11) << _EXTENSION_BITS | extension
        head, count = (head << 1 | frame.remote) << 2, 1 + _BASE_BITS + 2 + _EXTENSION_BITS + 3
    else:
        # identifier, RTR, IDE = 0, a reserved bit
        head, count = (frame.can_id << 1 | frame.remote) << 2, 1 + _BASE_BITS + 3
    size = len(frame.data)
    data = b"" if frame.remote else frame.data  # the length code of a remote frame stands alone
    bits = (head << 4 | size) << 8 * len(data) | int.from_bytes(data, "big")
    count += 4 + 8 * len(data)
    return bits << CRC_BITS | crc(bits, count), count + CRC_BITS


def crc(bits: int, count: int) -> int:
    """Return the checksum of `count` bits; zeros before the first one make no difference."""
    register = 0
    for byte in bits.to_bytes((count + 7) // 8, "big"):
        register = register << 8 & 0x7FFF ^ _CRC[register >> (CRC_BITS - 8) ^ byte]
    return register


def stuff_bits(bits: int, count: int) -> int:
    """Return how many bits are put in; one that is counts towards the next five.

    The first bit is dominant, as a start of frame is: bits that alternate before it change nothing.
    """
    padding = -count % 8
    bits |= (0x55 & (1 << padding) - 1) << count
    stuffed, state = 0, _START
    for byte in bits.to_bytes((count + padding) // 8, "big"):
        more, state = _STUFFING[state][byte]
        stuffed += more
    return stuffed


def _crc_of_byte(byte: int) -> int:
    register = byte << (CRC_BITS - 8)
    for _ in range(8):
        register <<= 1
        if register >> CRC_BITS:
            register ^= 1 << CRC_BITS | CRC_POLYNOMIAL
    return register


def _stuffing_of_byte(state: int, byte: int) -> tuple[int, int]:
    """Return the stuff bits that a byte brings, and the state after it.

    A state is the length of the run of equal bits so far, 0 to 4, times two, and their value.
    """
    run, last = divmod(state, 2)
    stuffed = 0
    for place in range(7, -1, -1):
        bit = byte >> place & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == _STUFF_AFTER:
            stuffed += 1
            run, last = 1, 1 - bit
    return stuffed, run * 2 + last


_START = 0
_CRC = [_crc_of_byte(byte) for byte in range(256)]
_STUFFING = [
    [_stuffing_of_byte(state, byte) for byte in range(256)] for state in range(2 * _STUFF_AFTER)
]


def priority(frame: Frame) -> int:
    """Return a frame's bits in arbitration as a number; the smaller one wins (ISO 11898-1).

    A base frame goes before an extended one with the same first eleven bits, a data frame before
    a remote one.
    """
    if frame.extended:
        base, extension = frame.can_id >> _EXTENSION_BITS, frame.can_id & 0x3FFFF
        return (base << 2 | 0b11) << 19 | extension << 1 | frame.remote
    return (frame.can_id << 2 | frame.remote << 1) << 19
