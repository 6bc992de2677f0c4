"""Reading an EDS (CiA 306) into entries, with errors that name the section to mend.

`canopen` parses the file; this module adds what its import drops without a word: limits of
REAL32 and the odd integer widths, the members of compact arrays, unreadable defaults.

Four keys beyond CiA 306 tie an object to the physics behind it:

| key | meaning |
|---|---|
| Unit, Factor | one digit stands for `Factor` of the SI unit `Unit` |
| Signal | the channel it shows or the command it gives, where that is not its ParameterName |
| Delta | change in digits that is an event for an event-driven TPDO |

They stand in the object's section, or, as checkers that know CiA 306 alone ask, in a line of
`[Comments]`: `Line1=6100sub1: Signal=pressure_a Unit=Pa Factor=2500000`. Such a line may also give
the DefaultValue or ParameterValue of a real number, which tools do not agree how to write.
"""

import configparser
import io
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ODArray, ODVariable
from canopen.objectdictionary.eds import import_eds

from hil_emulator.device.datatype import DATA_TYPES, DataType
from hil_emulator.device.entry import ACCESS_TYPES, Entry
from hil_emulator.errors import UserError

MANDATORY_OBJECTS = (0x1000, 0x1001, 0x1018)
"""CiA 301 7.5.1: device type, error register, identity."""

OBJECT_SECTION = re.compile(r"^[0-9A-Fa-f]{4}(sub[0-9A-Fa-f]+)?$", re.IGNORECASE)
BINDING = re.compile(r"^([0-9A-Fa-f]{4}(?:sub[0-9A-Fa-f]+)?):((?: \w+=\S+)+)$")
"""A line of [Comments] that gives keys to an object's section."""


def load(path: Path, node_id: int) -> list[Entry]:
    """Return every entry of an EDS or DCF, dummy types (index 1 to 7) included.

    Args:
        path: the file.
        node_id: replaces `$NODEID`, 1 to 127.

    Raises:
        UserError: the file is missing, is not an EDS, describes an object twice, lacks a
            mandatory object, or gives a value its data type cannot hold.

    """
    text = _read(path)
    sections = _parse(path, text)
    try:
        objects = import_eds(io.StringIO(text), node_id)  # type: ignore[no-untyped-call]
    except Exception as error:  # canopen answers damage with many kinds of exception
        raise UserError(f"{path} is not a usable EDS: {error}") from error
    missing = [f"0x{index:04X}" for index in MANDATORY_OBJECTS if index not in objects.indices]
    if missing:
        raise UserError(
            f"{path} lacks the mandatory object(s) {', '.join(missing)}; "
            "CiA 301 requires 0x1000, 0x1001 and 0x1018 in every device"
        )
    _add_bindings(sections)
    return [
        _entry(path, sections, variable, count, node_id)
        for variable, count in _variables(objects, sections)
    ]


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="latin-1")
    except OSError as error:
        raise UserError(f"cannot read the EDS {path}: {error.strerror}") from error


def _parse(path: Path, text: str) -> configparser.RawConfigParser:
    sections = configparser.RawConfigParser(inline_comment_prefixes=(";",))
    sections.optionxform = str  # type: ignore[assignment,method-assign]
    try:
        sections.read_string(text, str(path))
    except configparser.DuplicateSectionError as error:
        raise UserError(
            f"{path} describes one object twice: [{error.section}], again in line "
            f"{error.lineno}; keep one of them"
        ) from error
    except configparser.Error as error:
        raise UserError(f"{path} is not an EDS: {error}") from error
    seen: dict[str, str] = {}
    for name in filter(OBJECT_SECTION.match, sections.sections()):
        twin = seen.setdefault(name.upper(), name)
        if twin != name:
            raise UserError(f"{path} describes one object twice: [{twin}] and [{name}]")
    return sections


def _add_bindings(sections: configparser.RawConfigParser) -> None:
    """Copy the keys that lines of [Comments] give to objects into the objects' sections."""
    lines = sections["Comments"].values() if sections.has_section("Comments") else ()
    for found in filter(None, map(BINDING.match, lines)):
        section = _section_name(sections, found[1])
        if sections.has_section(section):
            for pair in found[2].split():
                key, _, value = pair.partition("=")
                sections.set(section, key, value)


def _variables(objects: Any, sections: configparser.RawConfigParser) -> Iterator[tuple[Any, int]]:
    """Yield every variable, with the number of members where it is a compact array's sub 0."""
    for index in objects:
        item = objects[index]
        if isinstance(item, ODVariable):
            yield item, 0
            continue
        compact = _compact_members(sections, index) if isinstance(item, ODArray) else 0
        for subindex in range(compact + 1) if compact else item:
            yield item[subindex], compact if subindex == 0 else 0


def _compact_members(sections: configparser.RawConfigParser, index: int) -> int:
    section = _section_name(sections, f"{index:04X}")
    return int(sections.get(section, "CompactSubObj", fallback="0") or "0", 0)


def _section_name(sections: configparser.RawConfigParser, wanted: str) -> str:
    if sections.has_section(wanted):
        return wanted
    return next((s for s in sections.sections() if s.upper() == wanted.upper()), wanted)


def _entry(
    path: Path,
    sections: configparser.RawConfigParser,
    variable: Any,
    compact_members: int,
    node_id: int,
) -> Entry:
    section = f"{variable.index:04X}"
    if not isinstance(variable.parent, type(None)) and hasattr(variable.parent, "subindices"):
        section += f"sub{variable.subindex:X}"
    section = _section_name(sections, section)
    where = f"{path} [{section}] {variable.name}"
    data_type = DATA_TYPES.get(variable.data_type)
    if data_type is None:
        raise UserError(f"{where}: DataType 0x{variable.data_type:X} is not one of CiA 301")
    if variable.access_type not in ACCESS_TYPES:
        raise UserError(f"{where}: AccessType {variable.access_type!r} is not one of CiA 306")
    factor = _real(where, sections, section, "Factor", 1.0)
    if factor == 0.0:
        raise UserError(f"{where}: Factor must be a finite number other than 0")
    return Entry(
        variable.index,
        variable.subindex,
        variable.name,
        data_type,
        "const" if compact_members else variable.access_type,
        default=compact_members or _default(where, sections, section, variable, data_type),
        mappable=variable.pdo_mappable,
        low=_limit(where, sections, section, "LowLimit", data_type, node_id),
        high=_limit(where, sections, section, "HighLimit", data_type, node_id),
        unit=sections.get(section, "Unit", fallback=""),
        factor=factor,
        relative=variable.relative,
        signal=sections.get(section, "Signal", fallback=""),
        delta=_real(where, sections, section, "Delta", 0.0),
    )


def _real(
    where: str, sections: configparser.RawConfigParser, section: str, key: str, missing: float
) -> float:
    text = sections.get(section, key, fallback="") or str(missing)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{where}: {key} must be a finite number, not {text!r}")
    return value


def _real_default(sections: configparser.RawConfigParser, section: str) -> float | None:
    for key in ("ParameterValue", "DefaultValue"):
        text = sections.get(section, key, fallback="").strip()
        try:
            return float(text)
        except ValueError:
            continue
    return None


def _default(
    where: str,
    sections: configparser.RawConfigParser,
    section: str,
    variable: Any,
    data_type: DataType,
) -> Any:
    """Return the value after a reset: ParameterValue of a DCF, else DefaultValue, else None."""
    value = variable.default if variable.value is None else variable.value
    if data_type.kind == "real":
        value = _real_default(sections, section)
    if value is None:
        text = sections.get(section, "DefaultValue", fallback="").strip()
        if text:
            raise UserError(f"{where}: DefaultValue {text!r} is not a {data_type.name}")
        return None
    if isinstance(value, str):
        return value.encode("utf-16-le" if data_type.name == "UNICODE_STRING" else "latin-1")
    if data_type.numeric and not data_type.low <= value <= data_type.high:
        raise UserError(f"{where}: DefaultValue {value} does not fit a {data_type.name}")
    return value


def _limit(
    where: str,
    sections: configparser.RawConfigParser,
    section: str,
    key: str,
    data_type: DataType,
    node_id: int,
) -> float | None:
    text = sections.get(section, key, fallback="").strip()
    if not text or not data_type.numeric:
        return None
    try:
        if data_type.kind == "real":
            return float(text)
        text = text.upper().replace(" ", "")
        offset = node_id if "$NODEID" in text else 0
        value = int(re.sub(r"\+?\$NODEID\+?", "", text), 0) + offset
    except ValueError:
        raise UserError(f"{where}: {key} {text!r} is not a {data_type.name}") from None
    if data_type.low < 0 and value > data_type.high:
        value -= 1 << data_type.bits  # limits of signed types are often written in hexadecimal
    return value
