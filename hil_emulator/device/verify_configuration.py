"""Verify configuration, 0x1020 (CiA 301 7.5.2.29).

A configuration tool writes date and time before it stores the parameters, and compares them later.
Any other change of a parameter clears both, so that the tool detects the change.
"""

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.storage import NOT_STORED

VERIFY_CONFIGURATION = 0x1020
DATE, TIME = 1, 2


class VerifyConfiguration:
    """Clears the date and time of the configuration when a parameter changes.

    Args:
        dictionary: the node's dictionary.

    """

    quiet_until_ns = NEVER  # acts when a parameter is written

    def __init__(self, dictionary: Dictionary) -> None:
        stamps = [dictionary.get(VERIFY_CONFIGURATION, n) for n in (DATE, TIME)]
        self._stamps = [stamp for stamp in stamps if stamp is not None]
        if self._stamps:
            dictionary.observe(self._written)

    def _written(self, entry: Entry) -> None:
        """Clear date and time, unless process data, error history or a command was written."""
        parameter = entry.access == "rw" and entry.index not in NOT_STORED
        if parameter and entry.index != VERIFY_CONFIGURATION:
            for stamp in self._stamps:
                stamp.value = 0
