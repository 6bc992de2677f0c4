"""One object of the dictionary: its description and its one current value."""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DataType

ACCESS_TYPES = frozenset({"ro", "wo", "rw", "rwr", "rww", "const"})
"""AccessType of CiA 306; rwr is a process input (TPDO only), rww a process output (RPDO only)."""


@dataclass(slots=True, eq=False)
class Entry:
    """One (index, sub-index) of the dictionary.

    Services that need the value every tick keep the entry and read `value`. There is no second
    copy of the value, so an SDO and a PDO always agree.

    Attributes:
        index: 16-bit index.
        subindex: 8-bit sub-index, 0 for a plain variable.
        name: ParameterName of the EDS.
        type: data type.
        access: access type as the EDS has it.
        mappable: whether the EDS allows it in a PDO.
        low: smallest value an SDO client may write; None without a limit.
        high: largest value an SDO client may write; None without a limit.
        unit: physical unit, "" without one.
        factor: physical value in `unit` per digit.
        offset: physical value in `unit` of 0 digits, such as that of a live zero.
        reach: smallest and largest digits that the device measures; None for the type's range.
        mask: significant bits of the value, 0 for all bits.
        signal: the channel it shows, or the command it gives: `Signal` of the EDS, else its name.
        delta: change in digits that triggers an event, 0 for any change (`Delta` of the EDS).
        retained: whether it is stored like a parameter although no client may write it.
        gated: whether a trigger decides which changes are events; without, each change is.
        relative: whether the default contains the node-ID ($NODEID).
        default: value after a reset.
        value: an int, float or bytes by data type; None while there is no data to read.
        catch_up: brings the value up to date where it lags behind, see `Lagging`.

    """

    index: int
    subindex: int
    name: str
    type: DataType
    access: str = "rw"
    _: KW_ONLY
    default: Any = None
    mappable: bool = False
    low: float | None = None
    high: float | None = None
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    reach: tuple[float, float] | None = None
    mask: int = 0
    relative: bool = False
    signal: str = ""
    delta: float = 0.0
    gated: bool = field(init=False)
    retained: bool = field(init=False, default=False)
    value: Any = field(init=False)
    catch_up: Callable[[], None] = field(init=False)

    def __post_init__(self) -> None:
        self.signal = self.signal or self.name
        self.gated = self.delta > 0.0
        if self.default is None:
            self.default = 0 if self.type.numeric else b""
        self.value = self.default

    def __repr__(self) -> str:
        return f"<Entry {self.where} {self.name!r}>"

    @property
    def where(self) -> str:
        """Index and sub-index as text, such as 0x1A00:01."""
        return f"0x{self.index:04X}:{self.subindex:02X}"

    @property
    def section(self) -> str:
        """Its section in an EDS, such as 1A00sub1."""
        return f"{self.index:04X}" + (f"sub{self.subindex:X}" if self.subindex else "")

    @property
    def readable(self) -> bool:
        """Whether an SDO client may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether an SDO client may write it."""
        return "w" in self.access

    @property
    def receivable(self) -> bool:
        """Whether an RPDO may carry it (CiA 306, AccessType)."""
        return self.mappable and self.access in ("rw", "rww", "wo")

    @property
    def transmittable(self) -> bool:
        """Whether a TPDO may carry it (CiA 306, AccessType)."""
        return self.mappable and self.access in ("rw", "rwr", "ro", "const")

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value: the EDS limits where given, else the type's."""
        low = self.type.low if self.low is None else self.low
        high = self.type.high if self.high is None else self.high
        return low, high

    def physical(self, digits: float) -> float:
        """Return the physical value of a number of digits."""
        return digits * self.factor + self.offset

    def digits(self, physical: float) -> float:
        """Return a physical value in digits, a whole number for an integer."""
        raw = (physical - self.offset) / self.factor
        return round(raw) if self.type.kind == "integer" else raw

    def check(self, value: Any) -> None:
        """Refuse a number beyond the limits (0609 0031, 0609 0032) or no number (0609 0030)."""
        if not self.type.numeric:
            return
        if not isinstance(value, int if self.type.kind == "integer" else (int, float)):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        low, high = self.bounds
        if value > high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
        if value < low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW)


_VALUE: Any = vars(Entry)["value"]
"""The slot of an entry's value."""


class Lagging(Entry):
    """An entry that shows a sample and whose value is not up to date.

    The first read or write of the value calls `catch_up`, which makes it an `Entry` again.
    """

    __slots__ = ()

    @property
    def value(self) -> Any:
        """The present value."""
        self.catch_up()
        return _VALUE.__get__(self)

    @value.setter
    def value(self, value: Any) -> None:
        self.catch_up()
        _VALUE.__set__(self, value)
