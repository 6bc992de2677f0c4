"""Triggers: changes of an object that are events for an event-driven TPDO."""

from collections.abc import Sequence

from hil_emulator.device.entry import Entry


class Trigger:
    """Fires when an object has moved by a delta, or has crossed a limit.

    Args:
        entry: the monitored object.
        others: entries that show the same quantity and share the event.
        delta: least change since the last event, in the entry's digits; 0 is off.

    Attributes:
        entries: all entries; they are `gated` while the trigger is on.

    """

    def __init__(self, entry: Entry, others: Sequence[Entry] = (), delta: float = 0.0) -> None:
        self.entries = (entry, *others)
        self._entry = entry
        self._shown = entry.value
        self.watch(delta)

    def watch(self, delta: float, lower: float | None = None, upper: float | None = None) -> None:
        """Set what fires.

        Args:
            delta: as above.
            lower: fires when the value falls below it or comes back.
            upper: fires when the value rises above it or comes back.

        """
        self._delta, self._lower, self._upper = delta, lower, upper
        self._zone = self._zone_of(self._entry.value)
        self.on = delta > 0.0 or lower is not None or upper is not None
        for entry in self.entries:
            entry.gated = self.on

    def fires(self) -> bool:
        """Return whether an event has occurred since the last call."""
        value = self._entry.value
        zone = self._zone_of(value)
        moved = 0.0 < self._delta <= abs(value - self._shown)
        if zone == self._zone and not moved:
            return False
        self._zone, self._shown = zone, value
        return True

    def _zone_of(self, value: float) -> int:
        if self._lower is not None and value < self._lower:
            return -1
        return int(self._upper is not None and value > self._upper)
