"""Default PDO mappings that contradict the rest of the file.

A device transmits its default mapping even if PDOMapping or AccessType of an object do not allow a
master this mapping. An entry that maps no object ends the mapping. A PDO with an impossible mapping
does not exist until a master has configured it.
"""

from collections.abc import Iterator, Sequence

from hil_emulator.device.cob_id import INVALID
from hil_emulator.device.datatype import BYTE_BOOLEAN
from hil_emulator.device.eds.report import Report
from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo_records import (
    COB_ID,
    LAST_DUMMY,
    MAX_BITS,
    MAX_PDOS,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_MAPPING,
)

_MAPPINGS = (("RPDO", RPDO_MAPPING), ("TPDO", TPDO_MAPPING))
_TO_COMMUNICATION = RPDO_MAPPING - RPDO_COMMUNICATION
"""From the index of a mapping record down to that of its communication record."""


class DefaultMappings:
    """Checks the mapping records of a file.

    Args:
        entries: every entry; some are altered.
        report: collects the remarks.

    """

    def __init__(self, entries: Sequence[Entry], report: Report) -> None:
        self._entries = {(entry.index, entry.subindex): entry for entry in entries}
        self._report = report

    def admit(self) -> None:
        """Make objects mappable where the file maps them; disable PDOs with impossible mappings."""
        for kind, first in _MAPPINGS:
            for index in range(first, first + MAX_PDOS):
                count = self._entries.get((index, 0))
                if count is not None and count.default:
                    self._cut(count)
                    problems = list(self._problems(count, kind))
                    if problems:
                        self._switch_off(index, kind, problems[0])

    def _cut(self, count: Entry) -> None:
        """End a mapping before the first entry that maps no object."""
        for subindex in range(1, count.default + 1):
            word = self._entries.get((count.index, subindex))
            if word is None or not word.default:
                text = f"{count.default} mapped objects, but entry {subindex} maps no object"
                self._report.note(f"{count.index:04X}", "", text)
                count.default = count.value = subindex - 1
                return

    def _problems(self, count: Entry, kind: str) -> Iterator[str]:
        """Yield the reasons why a mapping is impossible."""
        total = 0
        for subindex in range(1, count.default + 1):
            word = self._entries[count.index, subindex].default
            index, sub, bits = word >> 16, word >> 8 & 0xFF, word & 0xFF
            total += bits
            target = self._entries.get((index, sub))
            where = f"0x{index:04X}:{sub:02X}"
            if target is not None and (target.type.name, bits) == (BYTE_BOOLEAN.name, 8):
                self._widen(target)
            if index <= LAST_DUMMY:
                continue  # DummyUsage lists which of these an RPDO may map
            if target is None:
                yield f"{where} does not exist"
            elif bits != target.type.bits:
                yield f"{where} has {target.type.bits} bits, not {bits}"
            elif not (target.writable if kind == "RPDO" else target.readable):
                yield f"{where} is {target.access}"
            else:
                self._permit(target, kind)
        if total > MAX_BITS:
            yield f"{total} bits"

    def _widen(self, target: Entry) -> None:
        """Make a BOOLEAN that is mapped with 8 bits a byte, so that its mapping is accepted."""
        if target.type is not BYTE_BOOLEAN:
            target.type = BYTE_BOOLEAN
            self._report.note(target.section, "", "a BOOLEAN mapped as 8 bits; it takes a byte")

    def _permit(self, target: Entry, kind: str) -> None:
        if target.receivable if kind == "RPDO" else target.transmittable:
            return
        if target.access in ("rwr", "rww"):
            target.access = "rw"
        target.mappable = True
        self._report.note(
            target.section, "", f"mapped by default to {kind}s against its attributes"
        )

    def _switch_off(self, index: int, kind: str, problem: str) -> None:
        cob_id = self._entries.get((index - _TO_COMMUNICATION, COB_ID))
        if cob_id is None:
            return
        if cob_id.default & INVALID:
            text = f"this {kind} cannot be enabled with its default mapping: {problem}"
            self._report.note(f"{index:04X}", "", text)
            return
        cob_id.default = cob_id.value = cob_id.default | INVALID
        text = f"this {kind} cannot be mapped and does not exist: {problem}"
        self._report.note(f"{index:04X}", "", text)
