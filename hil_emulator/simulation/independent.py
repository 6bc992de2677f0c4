"""Which actuators of a machine share nothing, so that each group of them can have its own core."""

from collections.abc import Iterable
from dataclasses import replace

from hil_emulator.config.actuators import ActuatorSettings
from hil_emulator.config.machine import MachineSettings

Group = list[ActuatorSettings]


def parts(settings: MachineSettings, processes: int) -> list[MachineSettings]:
    """Divide a machine into parts that share neither bus nor supply.

    Each group of actuators that hang together goes, the largest first, to the part that has fewest.

    Args:
        settings: the machine.
        processes: largest number of parts, from 1.

    Returns:
        The parts in the order of the machine, with its actuators in that order in each; the machine
        itself where it cannot be divided.

    """
    groups = sorted(_hanging_together(settings.actuators), key=len, reverse=True)
    dealt: list[Group] = [[] for _ in range(min(processes, len(groups)))]
    for group in groups:
        min(dealt, key=len).extend(group)
    if len(dealt) == 1:
        return [settings]
    place = settings.actuators.index
    ordered = [sorted(members, key=place) for members in dealt]
    return [_part(settings, m) for m in sorted(ordered, key=lambda m: place(m[0]))]


def _hanging_together(actuators: Iterable[ActuatorSettings]) -> list[Group]:
    """Return the actuators by what joins them; a leg is on one supply."""
    found: list[tuple[set[tuple[str, str | None]], Group]] = []
    for actuator in actuators:
        shared = {("bus", actuator.bus), ("supply", actuator.supply)} - {("supply", None)}
        group, others = [actuator], []
        for things, members in found:
            if things & shared:
                shared |= things
                group += members
            else:
                others.append((things, members))
        found = [*others, (shared, group)]
    return [group for _, group in found]


def _part(settings: MachineSettings, actuators: Group) -> MachineSettings:
    there = {actuator.bus for actuator in actuators}
    return replace(
        settings,
        actuators=tuple(actuators),
        buses={name: bus for name, bus in settings.buses.items() if name in there},
        wires={name: wire for name, wire in settings.wires.items() if name in there},
    )
