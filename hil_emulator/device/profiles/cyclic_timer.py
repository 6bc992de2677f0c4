"""The encoder's cyclic timer: another name for TPDO1's event timer (CiA 406, object 0x6200)."""

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo_records import EVENT_TIMER, TPDO_COMMUNICATION

CYCLIC_TIMER = 0x6200


class CyclicTimer:
    """Keeps the two objects equal when either is written; both are in ms.

    Args:
        dictionary: the node's dictionary.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self._here = dictionary.number(CYCLIC_TIMER)
        self._there = dictionary.number(TPDO_COMMUNICATION, EVENT_TIMER)
        dictionary.observe(self._written)

    def _written(self, entry: Entry) -> None:
        if self._here is None or self._there is None or self._here.value == self._there.value:
            return
        if entry is self._here:
            # by the rules of TPDO1, so that it restarts with the new period
            self._dictionary.write(TPDO_COMMUNICATION, EVENT_TIMER, entry.value)
        elif entry is self._there:
            self._here.value = entry.value
