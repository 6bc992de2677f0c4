"""CAN frames, as exchanged between the parts of the emulator."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, overload

EXTENDED = 1 << 29
"""Bit of a COB-ID that marks a 29-bit identifier (CiA 301 7.5.2)."""

BUS_OFF, BUS_ERROR, RESTARTED, NO_ACKNOWLEDGE = 0x040, 0x088, 0x100, 0x020
"""Classes of error frames (Linux, can/error.h): a controller has gone off the bus; a frame was
destroyed, as protocol and bus error; a controller has come back; no other node acknowledged."""


class Frame(NamedTuple):
    """One classical CAN frame.

    Attributes:
        can_id: 11-bit identifier, or 29-bit where `extended` is set.
        data: 0 to 8 bytes; for a remote frame, zeros of the length of its length code.
        remote: a remote transmission request (RTR).
        extended: a 29-bit identifier; of the CANopen services here only PDOs can have one.

    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False

    @property
    def identifier(self) -> int:
        """The identifier as in a COB-ID (CiA 301 7.5.2): bit 29 is set for a 29-bit identifier."""
        return self.can_id | EXTENDED if self.extended else self.can_id


NO_FRAMES: Sequence[Frame] = ()


class Burst(Sequence[Frame]):
    """Data frames that are created at the first access, which is rare.

    Args:
        heads: identifier of each frame, and whether it has 29 bits.
        parts: returns the data of each frame, from `data`.
        data: of all frames.

    """

    __slots__ = ("_data", "_frames", "_heads", "_parts")

    def __init__(
        self,
        heads: Sequence[tuple[int, bool]],
        parts: Callable[[bytes], Sequence[bytes]],
        data: bytes,
    ) -> None:
        self._heads = heads
        self._parts = parts
        self._data = data
        self._frames: list[Frame] | None = None

    def __len__(self) -> int:
        return len(self._heads)

    def __iter__(self) -> Iterator[Frame]:
        return iter(self._made())

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Frame]: ...

    def __getitem__(self, index: int | slice) -> Frame | Sequence[Frame]:
        return self._made()[index]

    def __repr__(self) -> str:
        return repr(self._made())

    def _made(self) -> list[Frame]:
        """Return the frames, the same ones each time."""
        if self._frames is None:
            parts = zip(self._heads, self._parts(self._data), strict=True)
            self._frames = [Frame(i, data, False, extended) for (i, extended), data in parts]
        return self._frames
