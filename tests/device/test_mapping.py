"""PDO data of any types, compared with an encoder of shifts only."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from hil_emulator.device.datatype import DATA_TYPES, DataType
from hil_emulator.device.entry import Entry
from hil_emulator.device.mapping import Mapping

numbers = [kind for kind in DATA_TYPES.values() if kind.kind == "integer"]


def entry(kind: DataType, value: int) -> Entry:
    """Return an entry of a type with a value."""
    made = Entry(0x2000, 0, "x", kind)
    made.value = value
    return made


@st.composite
def mapped(draw: st.DrawFn) -> list[Entry]:
    """Draw entries of integer types that fit one frame."""
    entries: list[Entry] = []
    for kind in draw(st.lists(st.sampled_from(numbers), max_size=8)):
        if sum(e.type.bits for e in entries) + kind.bits <= 64:
            entries.append(entry(kind, draw(st.integers(int(kind.low), int(kind.high)))))
    return entries


@given(mapped())
def test_first_entry_is_in_the_lowest_bits(entries: list[Entry]) -> None:
    """Entries follow each other bit by bit from the first byte's lowest (CiA 301 7.4.5)."""
    bits = "".join(
        format(e.value & (1 << e.type.bits) - 1, f"0{e.type.bits}b") for e in reversed(entries)
    )
    size = -(-len(bits) // 8)
    mapping = Mapping(entries)
    assert mapping.size == size
    assert mapping.pack() == int(bits or "0", 2).to_bytes(size, "little")


@given(mapped())
def test_unpack_undoes_pack(entries: list[Entry]) -> None:
    """Unpacked values equal the packed ones, with sign."""
    mapping = Mapping(entries)
    assert list(mapping.unpack(mapping.pack())) == [e.value for e in entries]


def test_reals_mix_with_odd_widths() -> None:
    """A REAL32 next to a 24-bit integer keeps its IEEE 754 bytes."""
    kinds = {kind.name: kind for kind in DATA_TYPES.values()}
    real = entry(kinds["REAL32"], 0)
    real.value = 1.5
    mapping = Mapping([entry(kinds["INTEGER24"], -2), real])
    assert mapping.pack() == b"\xfe\xff\xff" + struct.pack("<f", 1.5)
    assert list(mapping.unpack(mapping.pack())) == [-2, 1.5]
