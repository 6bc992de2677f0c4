"""What a device profile adds to a node."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.trigger import Trigger


class Profile(Protocol):
    """The seam a node calls its profile through."""

    @property
    def sources(self) -> Mapping[tuple[int, int], str]:
        """By (index, sub-index) of every object the profile feeds, what feeds it."""
        ...

    @property
    def triggers(self) -> Sequence[Trigger]:
        """Which changes are events for event-driven TPDOs."""
        ...

    def reset(self) -> None:
        """Begin afresh: the dictionary has been reloaded."""

    def written(self, entries: Sequence[Entry]) -> None:
        """Act on objects that an RPDO has written, as on those an SDO writes."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Turn a new sample into objects; objects that show a channel as it is have it already."""

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return what becomes of the commands in SI, in each tick anew."""
        ...


class NoProfile:
    """A node whose objects show channels and give commands as they are."""

    quiet_until_ns = NEVER  # objects show channels and give commands as they are
    sources: Mapping[tuple[int, int], str] = {}
    triggers: Sequence[Trigger] = ()

    def reset(self) -> None:
        """Nothing to begin."""

    def written(self, entries: Sequence[Entry]) -> None:
        """Nothing to act on."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Nothing to add."""

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the commands."""
        return commands
