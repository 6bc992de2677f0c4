"""What the EDS promises, read by stock `canopen`: not by the reader our devices have."""

import configparser
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ODArray, ODVariable, datatypes
from canopen.objectdictionary.eds import import_eds

from hil_emulator.errors import UserError

REFUSE_WRITE, REFUSE_READ = 1, 2
"""ObjFlags (CiA 306 4.6.3): not to be written by a download, not to be read by a scan."""

FIRST_OBJECT = 0x1000
STRING_TYPES = frozenset(
    {datatypes.VISIBLE_STRING, datatypes.OCTET_STRING, datatypes.UNICODE_STRING, datatypes.DOMAIN}
)
TIME_TYPES = frozenset({datatypes.TIME_OF_DAY, datatypes.TIME_DIFFERENCE})
TIME_BITS = 48


class Expectation:
    """The content of an EDS.

    Args:
        path: the file.
        node_id: replaces `$NODEID`.

    Attributes:
        path: as given.
        sections: the file as `configparser` reads it, keys in lower case.
        variables: every variable from index 0x1000 on, by (index, sub-index).
        dummies: indices of the data types an RPDO may map as dummies.
        information: the file's `DeviceInfo`, as `canopen` shows it.

    Raises:
        UserError: the file cannot be read as an EDS.

    """

    def __init__(self, path: Path, node_id: int) -> None:
        self.path = path
        try:
            objects = import_eds(str(path), node_id)  # type: ignore[no-untyped-call]
        except (OSError, ValueError, KeyError, configparser.Error) as error:
            raise UserError(f"--eds {path}: canopen cannot read it: {error}") from error
        self.sections = configparser.RawConfigParser(inline_comment_prefixes=(";",))
        self.sections.read(path, encoding="latin-1")
        self._names = {name.upper(): name for name in self.sections.sections()}
        self.information = objects.device_information
        self.dummies = [index for index in objects if index < FIRST_OBJECT]
        self.variables: dict[tuple[int, int], Any] = {
            (variable.index, variable.subindex): variable
            for index in objects
            if index >= FIRST_OBJECT
            for variable in self._members(objects[index])
        }

    def __contains__(self, key: int | tuple[int, int]) -> bool:
        if isinstance(key, tuple):
            return key in self.variables
        return any(index == key for index, _ in self.variables)

    def indices(self, within: range = range(FIRST_OBJECT, 0x10000)) -> list[int]:
        """Return the indices of all objects of a range."""
        return sorted({index for index, _ in self.variables if index in within})

    def find(self, access: set[str], *, mappable: bool | None = None) -> list[Any]:
        """Return the variables of some access types, mappable or not where it matters."""
        return [
            variable
            for variable in self.variables.values()
            if variable.access_type in access and mappable in (None, variable.pdo_mappable)
        ]

    def writable(self, index: int, subindex: int = 0) -> bool:
        """Tell whether the EDS has an object and lets a client write it."""
        variable = self.variables.get((index, subindex))
        return variable is not None and bool(variable.writable)

    def flags(self, variable: Any) -> int:
        """Return the ObjFlags of a variable's object."""
        return self._number(variable.index, "objflags", "0")

    def object_type(self, index: int) -> int:
        """Return the ObjectType of an object, VAR where the EDS says none."""
        return self._number(index, "objecttype", "7")

    def _members(self, item: Any) -> Iterator[Any]:
        if isinstance(item, ODVariable):
            yield item
            return
        compact = isinstance(item, ODArray)
        count = self._number(item.index, "compactsubobj", "0") if compact else 0
        for subindex in range(count + 1) if count else item:
            yield item[subindex]

    def _number(self, index: int, key: str, missing: str) -> int:
        """Return a number from an object's own section; files write its name in either case."""
        section = self._names.get(f"{index:04X}", "")
        return int(self.sections.get(section, key, fallback=missing) or missing, 0)


def size(variable: Any) -> int:
    """Return the bytes of a variable in an SDO, 0 where they are not fixed."""
    if variable.data_type in STRING_TYPES:
        return 0
    return (bits(variable) + 7) // 8


def bits(variable: Any) -> int:
    """Return the bits of a variable in a PDO, 0 where it has no place there."""
    if variable.data_type in STRING_TYPES:
        return 0
    if variable.data_type == datatypes.BOOLEAN:
        return 1
    if variable.data_type in TIME_TYPES:
        return TIME_BITS
    return len(variable)


def type_range(variable: Any) -> tuple[int, int] | None:
    """Return the smallest and largest value of an integer type, None for other types."""
    width = bits(variable)
    if variable.data_type in datatypes.SIGNED_TYPES:
        return -(1 << (width - 1)), (1 << (width - 1)) - 1
    if variable.data_type in datatypes.UNSIGNED_TYPES:
        return 0, (1 << width) - 1
    return None


def encoded(variable: Any, value: int) -> bytes:
    """Return an integer as bytes of the variable's size, limits or not."""
    return value.to_bytes(size(variable), "little", signed=value < 0)


def default(variable: Any) -> bytes | None:
    """Return the bytes a variable has after a reset; None where the EDS does not say."""
    value = variable.default if variable.value is None else variable.value
    if value is None:
        return None
    if isinstance(value, str):
        wide = variable.data_type == datatypes.UNICODE_STRING
        return value.encode("utf-16-le" if wide else "latin-1")
    if variable.data_type in TIME_TYPES:
        return encoded(variable, value)
    raw: bytes = variable.encode_raw(value)
    return raw


def where(variable: Any) -> str:
    """Return index, sub-index and name for a message."""
    return f"{variable.index:04X}:{variable.subindex:02X} {variable.name}"
