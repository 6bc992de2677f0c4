"""Storing and restoring parameters: 0x1010 and 0x1011 (CiA 301 7.5.2.13, 7.5.2.14).

Sub-index 1 applies to all parameters, 2 to those from 0x1000 to 0x1FFF, 3 to those above. Stored
values replace the defaults at power-up and at an NMT reset. Restoring deletes them, with effect
from the next reset. Process data, the error history, programs and 0x1010 and 0x1011 are not stored.
"""

from collections.abc import Mapping
from typing import Any, Protocol

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import ALL_OBJECTS, COMMUNICATION_OBJECTS, Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.errors import UserError

STORE_PARAMETERS = 0x1010
RESTORE_PARAMETERS = 0x1011
SIGNATURES = {
    STORE_PARAMETERS: int.from_bytes(b"save", "little"),
    RESTORE_PARAMETERS: int.from_bytes(b"load", "little"),
}
ON_COMMAND = 1
"""Value that both objects return: the device stores on command, not autonomously."""

RANGES = {
    1: ALL_OBJECTS,
    2: COMMUNICATION_OBJECTS,
    3: range(COMMUNICATION_OBJECTS.stop, ALL_OBJECTS.stop),
}
PROGRAMS = range(0x1F50, 0x1F58)
"""Programs and their state (CiA 302-3), which are kept separately."""

NOT_STORED = frozenset({0x1003, STORE_PARAMETERS, RESTORE_PARAMETERS, *PROGRAMS})

Values = Mapping[tuple[int, int], bytes]
"""Encoded values by (index, sub-index)."""


class Storage(Protocol):
    """Interface of the memory for stored parameters."""

    def load(self) -> Values:
        """Return the values last saved, empty at first."""

    def save(self, values: Values) -> None:
        """Replace the saved values; raise OSError if that fails."""


class MemoryStorage:
    """Keeps parameters in memory: they survive resets, but not a restart of the program."""

    def __init__(self) -> None:
        self._values: Values = {}

    def load(self) -> Values:
        """Return the values last saved."""
        return self._values

    def save(self, values: Values) -> None:
        """Replace the saved values."""
        self._values = dict(values)


class ParameterStore:
    """The service behind 0x1010 and 0x1011.

    Args:
        dictionary: whose parameters are stored.
        storage: where they are kept.

    """

    quiet_until_ns = NEVER  # acts when a parameter is written

    def __init__(self, dictionary: Dictionary, storage: Storage) -> None:
        self._dictionary = dictionary
        self._storage = storage
        for index in SIGNATURES:
            dictionary.watch(index, self)

    def reset(self, indices: range) -> None:
        """Reload the parameters of a range: defaults, then stored values.

        Raises:
            UserError: a stored value does not fit its object.

        """
        self._dictionary.reset(indices)
        for (index, subindex), data in self._storage.load().items():
            entry = self._dictionary.get(index, subindex)
            if index not in indices or entry is None:
                continue
            try:
                value = entry.type.decode(data)
                entry.check(value)
            except SdoAbort as abort:
                raise UserError(
                    f"the stored value of {entry.where} {entry.name} does not fit "
                    f"{self._dictionary.source}: {abort}; delete the stored parameters"
                ) from None
            entry.value = value

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse anything but the signature (0800 0020)."""
        if value != SIGNATURES[entry.index]:
            raise SdoAbort(AbortCode.CANNOT_BE_STORED)

    def changed(self, entry: Entry) -> None:
        """Execute the signature; 0606 0000 if the storage fails."""
        entry.value = ON_COMMAND  # the signature is a command, not a value
        values = dict(self._storage.load())
        indices = RANGES.get(entry.subindex, range(0))
        if entry.index == STORE_PARAMETERS:
            values |= self._parameters(indices)
        else:
            values = {key: data for key, data in values.items() if key[0] not in indices}
        try:
            self._storage.save(values)
        except OSError:
            raise SdoAbort(AbortCode.HARDWARE_ERROR) from None

    def _parameters(self, indices: range) -> Values:
        return {
            (entry.index, entry.subindex): entry.type.encode(entry.value)
            for entry in self._dictionary
            if (entry.access == "rw" or entry.retained)
            and entry.index in indices
            and entry.index not in NOT_STORED
        }
