"""A valve amplifier behind an I/O module: enable and ramp of the set point.

    set point -> ramp -> enable -> command

Objects bind by `Signal`, or by the `map` of a configuration: `valve_enable` lets the set point act,
`valve_ramp_time` is the time from 0 to the larger limit of the set point. The ramp begins at 0 when
the amplifier is enabled. Each of them may be missing.
"""

from collections.abc import Mapping, Sequence

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.trigger import Trigger
from hil_emulator.errors import UserError

SET_POINT, ENABLE, RAMP_TIME = "valve_current", "valve_enable", "valve_ramp_time"

NS_PER_S = 1e9


class Amplifier:
    """The profile of a node that drives a valve through an amplifier.

    Args:
        dictionary: the node's dictionary; it has an object of `ENABLE` or `RAMP_TIME`.

    Attributes:
        sources: purpose of the objects by (index, sub-index).
        triggers: empty.

    Raises:
        UserError: the node has no set point.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        set_point = _number(dictionary, SET_POINT)
        self._enable = _number(dictionary, ENABLE)
        self._ramp_time = _number(dictionary, RAMP_TIME)
        if set_point is None:
            raise UserError(
                f"{dictionary.source}: valve_enable and valve_ramp_time act on valve_current of "
                "the same node; map an object to it, too"
            )
        self._full_scale = max(abs(set_point.physical(limit)) for limit in set_point.bounds)
        self._current = 0.0
        self._last_ns = 0
        self.sources = {
            (entry.index, entry.subindex): f"{what} of {SET_POINT}"
            for entry, what in ((self._enable, "enable"), (self._ramp_time, "ramp time"))
            if entry is not None
        }
        self.triggers: Sequence[Trigger] = ()

    def reset(self) -> None:
        """Begin with the valve closed."""
        self._current = 0.0

    def written(self, entries: Sequence[Entry]) -> None:
        """Do nothing; `command` reads enable and ramp time."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Do nothing; channels are shown unchanged."""

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the set point behind ramp and enable."""
        elapsed, self._last_ns = (now_ns - self._last_ns) / NS_PER_S, now_ns
        if SET_POINT not in commands:
            return commands
        if self._enabled(operational=operational):
            self._current = self._ramped(commands[SET_POINT], elapsed)
        else:
            self._current = 0.0
        return {**commands, SET_POINT: self._current}

    def _enabled(self, *, operational: bool) -> bool:
        entry = self._enable
        if entry is None:
            return True
        value = int(entry.value)
        return operational and bool(value & entry.mask if entry.mask else value)

    def _ramped(self, target: float, elapsed: float) -> float:
        """Return the set point after a time; a ramp time of 0 is no ramp."""
        time = 0.0 if self._ramp_time is None else self._ramp_time.physical(self._ramp_time.value)
        if time <= 0.0:
            return target
        step = self._full_scale * elapsed / time
        return self._current + min(step, max(-step, target - self._current))


def _number(dictionary: Dictionary, name: str) -> Entry | None:
    return next(iter(dictionary.numbers(name)), None)
