"""The interface of device profiles."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.trigger import Trigger


class Profile(Protocol):
    """The calls that a node makes to its profile."""

    @property
    def sources(self) -> Mapping[tuple[int, int], str]:
        """Source of every object that the profile feeds, by (index, sub-index)."""
        ...

    @property
    def triggers(self) -> Sequence[Trigger]:
        """Which changes are events for event-driven TPDOs."""
        ...

    def reset(self) -> None:
        """Restart after a reload of the dictionary."""

    def written(self, entries: Sequence[Entry]) -> None:
        """Act on objects that an RPDO has written, as on those an SDO writes."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Write a new sample to objects; objects that show a channel unchanged are up to date."""

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the modified commands in SI; called in each tick."""
        ...


class NoProfile:
    """A node without a profile: objects show channels and give commands unchanged."""

    quiet_until_ns = NEVER  # objects show channels and give commands unchanged
    sources: Mapping[tuple[int, int], str] = {}
    triggers: Sequence[Trigger] = ()

    def reset(self) -> None:
        """Do nothing."""

    def written(self, entries: Sequence[Entry]) -> None:
        """Do nothing."""

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Do nothing."""

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the commands unchanged."""
        return commands
