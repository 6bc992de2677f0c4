"""EDS and DCF of a node, in the keys of CiA 306 alone.

Extensions of the emulator's EDS files beyond CiA 306 are written to lines of `[Comments]`, where
`hil_emulator.device.eds` reads them. The same applies to a real number other than zero: some tools
read it as a decimal number, others as the bytes of IEEE 754, and a wrong value is worse than a
missing one.
"""

import configparser
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.eds.load import BINDING
from hil_emulator.device.eds.report import Report
from hil_emulator.device.eds.sections import OBJECT_SECTION, Section, parse, read
from hil_emulator.device.entry import Entry

OBJECT_KEYS = (
    "ParameterName", "ObjectType", "SubNumber", "DataType", "AccessType", "LowLimit", "HighLimit",
    "DefaultValue", "PDOMapping", "ObjFlags", "CompactSubObj", "ParameterValue",
)  # fmt: skip
"""Keys of an object's section that are copied (CiA 306-1)."""

SELF_CLEARING = frozenset({0x1003, 0x1010, 0x1011})
"""Objects a DCF gives no value: writing one is a command."""

SERIAL_NUMBER = (0x1018, 4)

_ZERO = "00000000"
"""Zero in every way of writing a REAL32."""


def eds(dictionary: Dictionary, file_name: str) -> str:
    """Return the EDS of a node.

    Args:
        dictionary: the node's dictionary, made from an EDS file.
        file_name: what the file will be called.

    """
    return _Sheet(dictionary, file_name).text()


def dcf(dictionary: Dictionary, file_name: str, node_name: str, bit_rate: int) -> str:
    """Return the DCF of a node: its EDS, its node-ID and the value of every parameter now.

    Args:
        dictionary: the node's dictionary, made from an EDS file.
        file_name: what the file will be called.
        node_name: what the node is called.
        bit_rate: of its bus [bit/s].

    """
    sheet = _Sheet(dictionary, file_name)
    sheet.commission(node_name, bit_rate)
    return sheet.text()


class _Sheet:
    """The sections of a file under way."""

    def __init__(self, dictionary: Dictionary, file_name: str) -> None:
        self._dictionary = dictionary
        self._sections = _parser()
        source = dictionary.source
        self._sections.read_dict({"FileInfo": {"FileName": file_name}})
        copied = {s.name: _copied(s) for s in parse(read(Path(source)), Report(source))}
        self._sections.read_dict(copied)
        self._sections["FileInfo"]["FileName"] = file_name
        self._remarks = self._free_remarks()
        for entry, section in self._described():
            self._describe(entry, section)

    def commission(self, node_name: str, bit_rate: int) -> None:
        """Turn the EDS into a DCF."""
        serial = self._dictionary.get(*SERIAL_NUMBER)
        self._sections["FileInfo"]["LastEDS"] = Path(self._dictionary.source).name
        self._sections["DeviceComissioning"] = {  # CiA 306 spells it so
            "NodeID": str(self._dictionary.node_id),
            "NodeName": node_name,
            "NodeRefd": "",
            "Baudrate": str(bit_rate // 1000),
            "NetNumber": "1",
            "NetworkName": "",
            "NetRefd": "",
            "CANopenManager": "0",
            "LSS_SerialNumber": str(0 if serial is None else serial.value),
        }
        for entry, section in self._described():
            if entry.writable and entry.readable and entry.index not in SELF_CLEARING:
                self._put(section, "ParameterValue", entry, entry.value)

    def text(self) -> str:
        """Return the file."""
        lines = {f"Line{n}": text for n, text in enumerate(self._remarks, 1)}
        self._sections["Comments"] = {"Lines": str(len(lines)), **lines}
        out = io.StringIO()
        self._sections.write(out, space_around_delimiters=False)
        return out.getvalue()

    def _free_remarks(self) -> list[str]:
        """Return the comments that the source has besides keys of objects."""
        if not self._sections.has_section("Comments"):
            return []
        comments = self._sections["Comments"].items()
        return [t for key, t in comments if key.upper() != "LINES" and not BINDING.match(t)]

    def _described(self) -> Iterator[tuple[Entry, configparser.SectionProxy]]:
        """Yield every entry with a section; members of compact arrays do not have a section."""
        names = {name.upper(): name for name in self._sections.sections()}
        for entry in self._dictionary:
            name = names.get(f"{entry.index:04X}SUB{entry.subindex:X}")
            if name is None and entry.subindex == 0:
                name = names.get(f"{entry.index:04X}")
            if name is not None and not self._sections[name].get("CompactSubObj"):
                yield entry, self._sections[name]

    def _describe(self, entry: Entry, section: configparser.SectionProxy) -> None:
        """Write the default, and what CiA 306 has no key for."""
        if entry.default is not None:
            self._put(section, "DefaultValue", entry, entry.default)
        keys = {}
        if entry.signal != entry.name:
            keys["Signal"] = entry.signal
        if entry.unit or entry.factor != 1.0:
            keys |= {"Unit": entry.unit, "Factor": f"{entry.factor!r}"}
        if entry.offset:
            keys["Offset"] = f"{entry.offset!r}"
        if entry.delta:
            keys["Delta"] = f"{entry.delta!r}"
        if entry.type.kind == "real":
            keys |= {key: section.pop(key) for key in ("LowLimit", "HighLimit") if key in section}
        self._remark(section, [f"{key}={value}" for key, value in keys.items() if value])

    def _put(self, section: configparser.SectionProxy, key: str, entry: Entry, value: Any) -> None:
        """Write a value into its section, or as a remark where it cannot stand there."""
        section.pop(key, None)
        if entry.type.kind == "real" and value:
            self._remark(section, [f"{key}={value!r}"])
        elif entry.relative and key == "DefaultValue":
            section[key] = f"$NODEID+0x{value - self._dictionary.node_id:X}"
        else:
            section[key] = _text(entry, value)

    def _remark(self, section: configparser.SectionProxy, pairs: Sequence[str]) -> None:
        if pairs:
            self._remarks.append(f"{section.name}: {' '.join(pairs)}")


def _copied(section: Section) -> dict[str, str]:
    """Return the keys of a section that are copied, those of objects as CiA 306 spells them."""
    if not OBJECT_SECTION.match(section.name):
        return section.keys
    return {key: section.get(key) for key in OBJECT_KEYS if key in section}


def _parser() -> configparser.RawConfigParser:
    parser = configparser.RawConfigParser(inline_comment_prefixes=(";",))
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    return parser


def _text(entry: Entry, value: Any) -> str:
    """Return a value as CiA 306 writes it: signed numbers decimal, long unsigned ones in hex."""
    kind = entry.type
    if kind.kind == "real":
        return _ZERO * (kind.size // 4)
    if kind.kind == "integer":
        return f"0x{value:0{2 * kind.size}X}" if kind.low == 0 and kind.bits > 16 else str(value)
    if kind.name == "UNICODE_STRING":
        return bytes(value).decode("utf-16-le")
    return value.decode("latin-1") if kind.name == "VISIBLE_STRING" else bytes(value).hex()
