"""An object that shows a wrong value while a fault is active."""

from collections.abc import Callable

from hil_emulator.device.entry import Entry

Wrong = Callable[[int, float], float]
"""Returns the value [digits] that is shown at a time [ns] in place of the correct one [digits]."""


class Distortion:
    """Shows wrong values of an object; writes to it change the correct value.

    Args:
        entry: the object, a number.
        wrong: computes the value shown.

    """

    def __init__(self, entry: Entry, wrong: Wrong) -> None:
        self._entry = entry
        self._wrong = wrong
        self._sound = self._shown = entry.value

    def publish(self, now_ns: int) -> None:
        """Show the present wrong value, saturated to the data type."""
        entry = self._entry
        if entry.value != self._shown:
            self._sound = entry.value
        kind = entry.type
        value = min(max(self._wrong(now_ns, self._sound), kind.low), kind.high)
        entry.value = self._shown = round(value) if kind.kind == "integer" else value

    def end(self) -> None:
        """Show the correct value again."""
        if self._entry.value == self._shown:
            self._entry.value = self._sound
