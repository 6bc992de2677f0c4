"""Objects of an EDS (CiA 306) as entries, with a remark on each harmless deviation."""

import math
from collections.abc import Iterator

from hil_emulator.device.datatype import DATA_TYPES, DataType
from hil_emulator.device.eds import compact
from hil_emulator.device.eds.compact import number
from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import OBJECT_SECTION, Section, Sheet
from hil_emulator.device.eds.values import Value, value
from hil_emulator.device.entry import ACCESS_TYPES, Entry

FIRST_OBJECT = 0x1000
"""Below it an EDS describes data types, which are no objects of a device (CiA 301 7.4)."""
VAR, DOMAIN_OBJECT, COLLECTIONS = 7, 2, (6, 8, 9)
"""ObjectType: a variable, a DOMAIN, and those with members (CiA 306)."""
DOMAIN_TYPE = 0x0F

_SHORT_ACCESS = {"r": "ro", "w": "wo", "wr": "rw", "unknown": "wo"}
"""Access types of makers' files; stock `canopen` reads "unknown" as write-only, too."""


class ObjectReader:
    """Creates entries from the sections of one file.

    Args:
        sheet: the sections.
        node_id: replaces $NODEID.
        report: collects the remarks.

    """

    def __init__(self, sheet: Sheet, node_id: int, report: Report) -> None:
        self._sheet = sheet
        self._node_id = node_id
        self._report = report
        self._members: dict[str, dict[int, Section]] = {}
        for section in sheet:
            if OBJECT_SECTION.match(section.name) and len(section.name) > 4:
                members = self._members.setdefault(section.name[:4].upper(), {})
                members[int(section.name[7:], 16)] = section

    def entries(self) -> Iterator[Entry]:
        """Yield every entry, including members whose object has no section.

        Raises:
            UserError: an entry cannot be understood; names section and key.

        """
        described = set()
        for section in self._sheet:
            index = section.name.upper()
            if OBJECT_SECTION.match(index) and len(index) == 4 and int(index, 16) >= FIRST_OBJECT:
                described.add(index)
                yield from self._object(int(index, 16), section)
        for index in self._members.keys() - described:
            if int(index, 16) >= FIRST_OBJECT:
                self._report.note(index, "", "has members, but no section of its own")
                yield from self._collection(int(index, 16), Section(index))

    def _object(self, index: int, section: Section) -> Iterator[Entry]:
        kind = number(section, "ObjectType", self._report) or VAR
        members = self._members.get(f"{index:04X}")
        if kind in COLLECTIONS or members or number(section, "CompactSubObj", self._report):
            if kind not in COLLECTIONS:
                self._report.note(section.name, "ObjectType", "a variable, but it has members")
            yield from self._collection(index, section)
        else:
            yield self._entry(index, 0, section, DOMAIN_TYPE if kind == DOMAIN_OBJECT else 0)

    def _collection(self, index: int, section: Section) -> Iterator[Entry]:
        described = self._members.get(f"{index:04X}", {})
        members = {**dict(compact.members(self._sheet, section, self._report)), **described}
        announced = number(section, "SubNumber", self._report)
        if announced and announced != len(members):
            self._report.note(section.name, "SubNumber", "is not the number of its members")
        if not members:
            self._report.note(section.name, "", "has no members; left out")
        for subindex, member in sorted(members.items()):
            if subindex > 0xFF:
                raise self._report.refusal(member.name, "", "a sub-index is 0 to FF")
            yield self._entry(index, subindex, member)

    def _entry(self, index: int, subindex: int, section: Section, code: int = 0) -> Entry:
        data_type = self._type(section, code)
        default = self._default(section, data_type)
        name = section.get("ParameterName")
        if not name:
            name = f"0x{index:04X}:{subindex:02X}"
            self._report.note(section.name, "ParameterName", "missing")
        return Entry(
            index,
            subindex,
            name,
            data_type,
            self._access(section),
            default=default.value,
            mappable=bool(number(section, "PDOMapping", self._report)),
            low=self._limit(section, "LowLimit", data_type),
            high=self._limit(section, "HighLimit", data_type),
            unit=section.get("Unit"),
            factor=self._real(section, "Factor", 1.0),
            offset=self._real(section, "Offset", 0.0),
            relative=default.relative,
            signal=section.get("Signal"),
            delta=self._real(section, "Delta", 0.0),
        )

    def _type(self, section: Section, code: int) -> DataType:
        code = number(section, "DataType", self._report) or code
        if not code:
            raise self._report.refusal(section.name, "DataType", "is missing; CiA 306 demands it")
        defined = self._sheet.get(f"{code:X}sub1")  # a type of the file's own, as some editors do
        code = number(defined, "DefaultValue", self._report) or code
        if code not in DATA_TYPES:
            text = f"0x{code:X} is not of CiA 301; taken as a DOMAIN"
            self._report.note(section.name, "DataType", text)
        return DATA_TYPES.get(code, DATA_TYPES[DOMAIN_TYPE])

    def _access(self, section: Section) -> str:
        text = section.get("AccessType").partition("#")[0].strip().lower()
        access = _SHORT_ACCESS.get(text, text)
        if access not in ACCESS_TYPES:
            allowed = ", ".join(sorted(ACCESS_TYPES))
            raise self._report.refusal(
                section.name, "AccessType", f"{text!r} is not one of {allowed} (CiA 306)"
            )
        if access != text:
            self._report.note(section.name, "AccessType", f"{text!r} taken as {access}")
        return access

    def _default(self, section: Section, data_type: DataType) -> Value:
        """Return the value after a reset: ParameterValue of a DCF, else DefaultValue, else None."""
        for key in ("ParameterValue", "DefaultValue"):
            text = section.get(key)
            if not text:
                continue
            try:
                parsed = value(text, data_type, self._node_id)
            except OverflowError:
                text = f"{text} does not fit a {data_type.name}; correct it, or the DataType"
                raise self._report.refusal(section.name, key, text) from None
            except ValueError:
                text = f"{text!r} is no {data_type.name}; without a value"
                self._report.note(section.name, key, text)
                continue
            if parsed.odd:
                self._report.note(section.name, key, parsed.odd)
            return parsed
        return Value(None)

    def _limit(self, section: Section, key: str, data_type: DataType) -> float | None:
        """Return a limit, or None if its text is empty or the type is narrower."""
        text = section.get(key)
        if not text or not data_type.numeric:
            return None
        try:
            limit: float = value(text, data_type, self._node_id).value
        except (ValueError, OverflowError):
            self._report.note(section.name, key, f"{text!r} is no {data_type.name}; no limit")
            return None
        return limit

    def _real(self, section: Section, key: str, missing: float) -> float:
        """Return the number of a key beyond CiA 306, `missing` if its text is not usable."""
        text = section.get(key)
        if not text:
            return missing
        try:
            real = float(text)
        except ValueError:
            real = math.nan
        if math.isfinite(real) and (real or not missing):
            return real
        self._report.note(section.name, key, f"{text!r} is no usable number; {missing:g} instead")
        return missing
