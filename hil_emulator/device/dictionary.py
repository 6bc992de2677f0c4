"""The object dictionary of one node: one value per object, and the rules of access to it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.eds import load as eds
from hil_emulator.device.eds.report import Remark
from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo_records import LAST_DUMMY
from hil_emulator.device.scale import Scale
from hil_emulator.errors import UserError

UNCONFIGURED = 0xFF
"""Node-ID of an unconfigured device (CiA 305)."""

COMMUNICATION_OBJECTS = range(0x1000, 0x2000)
"""Indices that NMT reset communication reloads (CiA 301 7.3.2.2.1)."""

ALL_OBJECTS = range(0x1000, 0x10000)
"""Indices that NMT reset node reloads."""


class Watcher(Protocol):
    """A service that owns an object: it may refuse a new value and is notified of changes."""

    def check(self, entry: Entry, value: Any) -> None:
        """Raise `SdoAbort` to refuse `value`; called before it is stored."""

    def changed(self, entry: Entry) -> None:
        """Act on `entry` having been written; `SdoAbort` where that fails."""


class Dictionary:
    """Object dictionary of one node: types, limits, access, and one current value per object.

    Args:
        entries: every object; indices 1 to 7 are taken as the dummies an RPDO may map.
        node_id: the node's number, 1 to 127, or `UNCONFIGURED`.
        source: where the entries come from, for messages.

    Attributes:
        remarks: deviations from CiA 306 in the source file.
        bit_rates: bit rates that the device supports [bit/s]; empty if the file lists no rate.
        extended_ids: whether its PDOs may have 29-bit identifiers.
        before_write: called before a value is stored, or refused.

    Raises:
        UserError: the node id is outside 1 to 127.

    """

    def __init__(self, entries: Iterable[Entry], node_id: int, source: str = "dictionary") -> None:
        if not 1 <= node_id <= 127 and node_id != UNCONFIGURED:
            raise UserError(f"node id {node_id} is outside 1 to 127 (CiA 301 7.3.5)")
        self.node_id = node_id
        self.source = source
        self.remarks: Sequence[Remark] = ()
        self.bit_rates: frozenset[int] = frozenset()
        self.extended_ids = True
        self.before_write: Callable[[], None] = lambda: None
        self._entries: dict[tuple[int, int], Entry] = {}
        self._dummies: dict[int, Entry] = {}
        self._assigned: set[Entry] = set()
        self._scaled: set[Entry | None] = set()
        self._indices: set[int] = set()
        self._watchers: dict[int, Watcher] = {}
        self._observers: list[Callable[[Entry], None]] = []
        for entry in entries:
            if entry.index <= LAST_DUMMY:
                self._dummies[entry.index] = entry
            else:
                self._entries[entry.index, entry.subindex] = entry
                self._indices.add(entry.index)

    @classmethod
    def from_eds(cls, path: Path, node_id: int) -> "Dictionary":
        """Read an EDS or DCF.

        Raises:
            UserError: the node id is outside 1 to 127, or the file is missing, is not an EDS,
                describes an object twice or lacks 0x1000 or 0x1001.

        """
        if not 1 <= node_id <= 127 and node_id != UNCONFIGURED:
            raise UserError(f"node id {node_id} is outside 1 to 127 (CiA 301 7.3.5)")
        sheet = eds.load(Path(path), node_id)
        made = cls(sheet.entries, node_id, str(path))
        made.remarks, made.bit_rates = sheet.remarks, sheet.bit_rates
        return made

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def __contains__(self, index: object) -> bool:
        return index in self._indices

    def get(self, index: int, subindex: int = 0) -> Entry | None:
        """Return an entry, or None if the EDS lacks it."""
        return self._entries.get((index, subindex))

    def number(self, index: int, subindex: int = 0) -> Entry | None:
        """Return a numeric entry of a device profile, or None if the EDS lacks it.

        Raises:
            UserError: the EDS declares it as text or DOMAIN.

        """
        entry = self.get(index, subindex)
        if entry is not None and not entry.type.numeric:
            raise UserError(
                f"{self.source} [{entry.section}] DataType: {entry.type.name}, where the device's "
                "profile has a number"
            )
        return entry

    def entry(self, index: int, subindex: int = 0) -> Entry:
        """Return an entry, or raise `SdoAbort` (0602 0000, 0609 0011)."""
        match = self._entries.get((index, subindex))
        if match is not None:
            return match
        exists = index in self._indices
        raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX if exists else AbortCode.NO_SUCH_OBJECT)

    def dummy(self, index: int) -> Entry | None:
        """Return the dummy entry of a data type, or None where the EDS forbids its use."""
        return self._dummies.get(index)

    def forget_signals(self) -> None:
        """Unbind all objects from channels and commands; names of the EDS no longer bind."""
        for entry in self._entries.values():
            entry.signal = ""

    def assign(self, entry: Entry, signal: str, scale: Scale | None = None) -> None:
        """Bind an object to a channel or a command. Several objects may show one channel.

        Args:
            entry: the object.
            signal: the channel or command.
            scale: physical value of a digit; None keeps the scale of the EDS.

        """
        entry.signal = signal
        self._assigned.add(entry)
        if scale is not None:
            entry.unit, entry.factor, entry.offset = scale.unit, scale.factor, scale.offset
            self._scaled.add(entry)

    def scaled(self, entry: Entry | None) -> bool:
        """Return whether a scale was assigned to an object; a profile must not change it."""
        return entry in self._scaled

    def named(self, name: str) -> Entry | None:
        """Return the first entry that `showing` returns, or None."""
        entries = self.showing(name)
        return entries[0] if entries else None

    def showing(self, name: str) -> list[Entry]:
        """Return the entries with this Signal (ParameterName, if the EDS has no Signal).

        Raises:
            UserError: several objects have this name without having been assigned it.

        """
        entries = [entry for entry in self._entries.values() if entry.signal == name]
        if len(entries) > 1 and not self._assigned.issuperset(entries):
            places = ", ".join(entry.where for entry in entries)
            raise UserError(
                f"{self.source}: ParameterName or Signal {name!r} is not unique: {places}"
            )
        return entries

    def numbers(self, name: str) -> list[Entry]:
        """Return the entries of `showing`, all of a numeric type.

        Raises:
            UserError: as `showing`, and if the type of an entry is not numeric.

        """
        entries = self.showing(name)
        for entry in entries:
            if not entry.type.numeric:
                raise UserError(
                    f"{self.source} {entry.where} {entry.signal}: a {entry.type.name} cannot "
                    "hold a number"
                )
        return entries

    def read(self, index: int, subindex: int = 0) -> Any:
        """Return a value as an SDO client would see it.

        Raises:
            SdoAbort: 0602 0000, 0609 0011, 0601 0001 for a write-only object, or 0800 0024
                while there is no data.

        """
        entry = self.entry(index, subindex)
        if not entry.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        if entry.value is None:
            raise SdoAbort(AbortCode.NO_DATA)
        return entry.value

    def write(self, index: int, subindex: int, value: Any) -> None:
        """Store a value under the access rules of an SDO client.

        Raises:
            SdoAbort: no such object, read-only, beyond the limits, or refused by its service.

        """
        self.before_write()
        entry = self.writable(index, subindex)
        entry.check(value)
        watcher = self._watchers.get(index)
        if watcher is not None:
            watcher.check(entry, value)
        entry.value = value
        if watcher is not None:
            watcher.changed(entry)
        for observe in self._observers:
            observe(entry)

    def writable(self, index: int, subindex: int) -> Entry:
        """Return an entry an SDO client may write, or raise `SdoAbort` (0601 0002 and others)."""
        entry = self.entry(index, subindex)
        if not entry.writable:
            raise SdoAbort(AbortCode.READ_ONLY)
        return entry

    def upload(self, index: int, subindex: int) -> bytes:
        """Return a value's bytes; raises like `read`."""
        value = self.read(index, subindex)
        return self._entries[index, subindex].type.encode(value)

    def download(self, index: int, subindex: int, data: bytes) -> None:
        """Store a value given as bytes; raises like `write`, and 0607 0012/0013 on length."""
        self.write(index, subindex, self.writable(index, subindex).type.decode(data))

    def watch(self, index: int, watcher: Watcher) -> None:
        """Make a service the owner of an object: it checks new values and is notified of them."""
        self._watchers[index] = watcher

    def observe(self, observer: Callable[[Entry], None]) -> None:
        """Notify a service of every written entry, whichever service owns the entry."""
        self._observers.append(observer)

    def reset(self, indices: range) -> None:
        """Reload defaults. The node notifies the services once all values are in place."""
        for entry in self._entries.values():
            if entry.index in indices:
                entry.value = entry.default

    def renumber(self, node_id: int) -> None:
        """Give the node another node-ID, and every default that contains it."""
        for entry in self._entries.values():
            if entry.relative:
                entry.default += node_id - self.node_id
        self.node_id = node_id

    def set_default(self, where: str | int | Entry, value: Any) -> None:
        """Set value and default of a variable given by name, by index or itself.

        Raises:
            UserError: there is no such object, or its type or limits exclude the value.

        """
        if isinstance(where, Entry):
            entry: Entry | None = where
        else:
            entry = self.named(where) if isinstance(where, str) else self.get(where)
        if entry is None:
            shown = where if isinstance(where, str) else f"0x{where:04X}"
            raise UserError(f"{self.source} has no object {shown}")
        try:
            entry.check(value)
        except SdoAbort as abort:
            raise UserError(
                f"{self.source} {entry.where} {entry.name}: {value} is refused, {abort}"
            ) from None
        entry.default = entry.value = value
