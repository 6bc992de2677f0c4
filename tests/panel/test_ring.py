"""The ring of shared memory: all rows arrive in order, or are reported as lost."""

import hypothesis.strategies as st
from hypothesis import given

from hil_emulator.panel.ring import LARGEST, RingReader, RingWriter

SIZE = 4 * LARGEST


def test_what_is_written_is_read_in_order_across_the_end() -> None:
    """A reader that keeps pace gets every byte, however often the ring goes round."""
    writer = RingWriter(SIZE)
    reader = RingReader(writer.fd)
    for number in range(40):
        entry = number.to_bytes(4, "little") * 100_003
        writer.write(entry, number)
        assert reader.read() == entry
        assert reader.stamp_ns == number
    assert reader.missed == 0
    reader.close()
    writer.close()


def test_a_reader_that_sleeps_learns_what_it_has_missed() -> None:
    """Overwritten bytes are never handed out; reading goes on at a whole entry."""
    writer = RingWriter(SIZE)
    reader = RingReader(writer.fd)
    for _ in range(5):
        writer.write(bytes(LARGEST), 0)
    assert reader.read() == b""
    assert reader.missed == 5 * LARGEST
    writer.write(b"next", 0)
    assert reader.read() == b"next"
    reader.close()
    writer.close()


@given(st.lists(st.tuples(st.binary(max_size=300), st.booleans()), max_size=60))
def test_a_reader_never_sees_half_an_entry(course: list[tuple[bytes, bool]]) -> None:
    """Whenever it looks, it gets what was written since it looked last."""
    writer = RingWriter(SIZE)
    reader = RingReader(writer.fd)
    expected = b""
    for entry, looks in course:
        writer.write(entry, 0)
        expected += entry
        if looks:
            assert reader.read() == expected
            expected = b""
    reader.close()
    writer.close()
