"""An object that shows something else than its value, as long as something is wrong with it."""

from collections.abc import Callable

from hil_emulator.device.entry import Entry

Wrong = Callable[[int, float], float]
"""Returns what is shown at a time [ns] in place of a value [digits]."""


class Distortion:
    """Shows wrong values of an object; what feeds it, or writes it, changes the sound one.

    Args:
        entry: the object, a number.
        wrong: what it shows.

    """

    def __init__(self, entry: Entry, wrong: Wrong) -> None:
        self._entry = entry
        self._wrong = wrong
        self._sound = self._shown = entry.value

    def publish(self, now_ns: int) -> None:
        """Show the wrong value of now, within what the data type can hold."""
        entry = self._entry
        if entry.value != self._shown:
            self._sound = entry.value
        kind = entry.type
        value = min(max(self._wrong(now_ns, self._sound), kind.low), kind.high)
        entry.value = self._shown = round(value) if kind.kind == "integer" else value

    def end(self) -> None:
        """Show the sound value again."""
        if self._entry.value == self._shown:
            self._entry.value = self._sound
