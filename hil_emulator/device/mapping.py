"""Mapping of a PDO: words of 0x1600 and 0x1A00 resolved to packed entries."""

import struct
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter
from typing import Any

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo_records import LAST_DUMMY, MAX_BITS

_VALUE = attrgetter("value")


def resolve(dictionary: Dictionary, word: int, *, receive: bool) -> Entry:
    """Return the entry a mapping word (index, sub-index, bits) names.

    Raises:
        SdoAbort: 0602 0000 without such an object, 0604 0041 where it exists but cannot be
            mapped in this direction or has another length.

    """
    index, subindex, bits = word >> 16, (word >> 8) & 0xFF, word & 0xFF
    if index <= LAST_DUMMY:
        entry = dictionary.dummy(index) if receive and subindex == 0 else None
        if entry is None:
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
    else:
        if index not in dictionary:
            raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
        entry = dictionary.get(index, subindex)
        if entry is None or not (entry.receivable if receive else entry.transmittable):
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
    if bits == 0 or bits != entry.type.bits:  # strings have no length here, so no place
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    return entry


class Mapping:
    """An ordered list of entries as the data of one CAN frame (CiA 301 7.5.2.36).

    Args:
        entries: objects in the frame, the first in the least significant bits.

    Attributes:
        entries: as given.
        size: length of the frame's data in bytes.
        unpacker: same as `unpack`, without a call in between for frames of one `struct`.

    Raises:
        SdoAbort: 0604 0042, more than 64 bits.

    """

    def __init__(self, entries: Sequence[Entry]) -> None:
        self.entries = tuple(entries)
        bits = sum(entry.type.bits for entry in entries)
        if bits > MAX_BITS:
            raise SdoAbort(AbortCode.PDO_LENGTH_EXCEEDED)
        self.size = (bits + 7) // 8
        codes = [entry.type.struct_code for entry in entries]
        # One struct does the whole frame, unless a type has no struct format (24 bits, BOOLEAN).
        self._struct = struct.Struct("<" + "".join(codes)) if all(codes) else None
        self.unpacker: Callable[[bytes], Sequence[Any]] = (
            self.unpack if self._struct is None else self._struct.unpack_from
        )

    def placed(self) -> Iterator[tuple[int, Entry]]:
        """Yield each object with its least significant bit; dummy entries leave a gap."""
        start = 0
        for entry in self.entries:
            if entry.index > LAST_DUMMY:
                yield start, entry
            start += entry.type.bits

    def pack(self) -> bytes:
        """Return the entries' values now as frame data."""
        if self._struct is not None:
            return self._struct.pack(*map(_VALUE, self.entries))
        word = offset = 0
        for entry in self.entries:
            raw = int.from_bytes(entry.type.encode(entry.value), "little")
            word |= (raw & ((1 << entry.type.bits) - 1)) << offset
            offset += entry.type.bits
        return word.to_bytes(self.size, "little")

    def unpack(self, data: bytes) -> Sequence[Any]:
        """Return one value per entry from frame data of at least `size` bytes."""
        if self._struct is not None:
            return self._struct.unpack_from(data)
        word = int.from_bytes(data, "little")
        values = []
        for entry in self.entries:
            raw = word & ((1 << entry.type.bits) - 1)
            values.append(_number(entry, raw))
            word >>= entry.type.bits
        return values


def _number(entry: Entry, raw: int) -> Any:
    kind = entry.type
    if kind.kind == "real":
        (value,) = struct.unpack("<" + kind.struct_code, raw.to_bytes(kind.size, "little"))
        return value
    if kind.low < 0 and raw > kind.high:
        return raw - (1 << kind.bits)
    return raw
