"""The content of the EDS, with which the device is compared."""

from pathlib import Path

from hil_emulator.device.datatype import DATA_TYPES, DataType
from hil_emulator.device.eds.compact import number
from hil_emulator.device.eds.load import load
from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import Section, parse, read
from hil_emulator.device.entry import Entry

REFUSE_WRITE, REFUSE_READ = 1, 2
"""ObjFlags (CiA 306 4.6.3): excluded from downloads, excluded from scans."""

FIRST_OBJECT = 0x1000
VAR = 7
"""ObjectType of a variable, and of an object without the key ObjectType (CiA 306 4.6.3)."""


class Expectation:
    """The content of an EDS or DCF.

    Args:
        path: the file.
        node_id: replaces `$NODEID`.

    Attributes:
        path: as given.
        sheet: the sections of the file.
        variables: every variable from index 0x1000 on, by (index, sub-index).
        dummies: indices of the data types an RPDO may map as dummies.

    Raises:
        UserError: the file cannot be read as an EDS.

    """

    def __init__(self, path: Path, node_id: int) -> None:
        self.path = path
        entries = load(path, node_id).entries
        self._report = Report(str(path))
        self.sheet = parse(read(path), self._report)
        self.dummies = [entry.index for entry in entries if entry.index < FIRST_OBJECT]
        self.variables = {
            (entry.index, entry.subindex): entry for entry in entries if entry.index >= FIRST_OBJECT
        }

    def __contains__(self, key: int | tuple[int, int]) -> bool:
        if isinstance(key, tuple):
            return key in self.variables
        return any(index == key for index, _ in self.variables)

    def indices(self, within: range = range(FIRST_OBJECT, 0x10000)) -> list[int]:
        """Return the indices of all objects of a range."""
        return sorted({index for index, _ in self.variables if index in within})

    def find(self, access: set[str], *, mappable: bool | None = None) -> list[Entry]:
        """Return the variables of some access types, filtered by `mappable` unless None."""
        return [
            variable
            for variable in self.variables.values()
            if variable.access in access and mappable in (None, variable.mappable)
        ]

    def writable(self, index: int, subindex: int = 0) -> bool:
        """Return whether the EDS has an object that a client may write."""
        variable = self.variables.get((index, subindex))
        return variable is not None and variable.writable

    def limited(self, index: int, value: int) -> int:
        """Return a value for an object, or the object's upper limit if that is lower."""
        high = self.variables[index, 0].high
        return value if high is None else min(value, int(high))

    def default(self, variable: Entry) -> bytes | None:
        """Return a variable's bytes after a reset; None if the EDS has no default."""
        section = self._section(variable)
        text = section.get("ParameterValue") or section.get("DefaultValue")
        return variable.type.encode(variable.default) if text else None

    def flags(self, variable: Entry) -> int:
        """Return the ObjFlags of a variable's object."""
        return number(self.sheet.get(f"{variable.index:04X}"), "ObjFlags", self._report)

    def object_type(self, index: int) -> int:
        """Return the ObjectType of an object, VAR if the EDS lacks the key."""
        return number(self.sheet.get(f"{index:04X}"), "ObjectType", self._report) or VAR

    def count(self, key: str) -> int:
        """Return a number of `[DeviceInfo]`."""
        return number(self.sheet.get("DeviceInfo"), key, self._report)

    def _section(self, variable: Entry) -> Section:
        index, member = f"{variable.index:04X}", f"{variable.index:04X}sub{variable.subindex:X}"
        return self.sheet.get(member if member in self.sheet else index)


def type_range(variable: Entry) -> tuple[int, int] | None:
    """Return the smallest and largest value of an integer type, None for other types."""
    kind = variable.type
    return (int(kind.low), int(kind.high)) if kind.kind == "integer" else None


def type_code(kind: DataType) -> int:
    """Return the code of a data type (CiA 301 7.4.7)."""
    return next(code for code, data_type in DATA_TYPES.items() if data_type.name == kind.name)


def encoded(variable: Entry, value: int) -> bytes:
    """Return an integer as bytes of the variable's size, without a check of limits."""
    return value.to_bytes(variable.type.size, "little", signed=value < 0)


def where(variable: Entry) -> str:
    """Return index, sub-index and name for a message."""
    return f"{variable.index:04X}:{variable.subindex:02X} {variable.name}"
