"""Division of a machine into independent groups of actuators, one per process."""

from collections.abc import Iterable
from dataclasses import replace

from hil_emulator.config.actuators import ActuatorSettings
from hil_emulator.config.machine import MachineSettings

Group = list[ActuatorSettings]


def parts(settings: MachineSettings, processes: int) -> list[MachineSettings]:
    """Divide a machine into parts that share neither bus nor supply.

    Groups of connected actuators are assigned, the largest first, to the part with the fewest
    actuators.

    Args:
        settings: the machine.
        processes: largest number of parts, from 1.

    Returns:
        The parts, with the actuators in the order of the machine; the machine itself if it cannot
        be divided.

    """
    groups = sorted(_connected(settings.actuators), key=len, reverse=True)
    dealt: list[Group] = [[] for _ in range(min(processes, len(groups)))]
    for group in groups:
        min(dealt, key=len).extend(group)
    if len(dealt) == 1:
        return [settings]
    place = settings.actuators.index
    ordered = [sorted(members, key=place) for members in dealt]
    return [_part(settings, m) for m in sorted(ordered, key=lambda m: place(m[0]))]


def _connected(actuators: Iterable[ActuatorSettings]) -> list[Group]:
    """Return groups of connected actuators; the joints of a leg are on one supply."""
    groups: list[tuple[set[tuple[str, str | None]], Group]] = []
    for actuator in actuators:
        shared = {("bus", actuator.bus), ("supply", actuator.supply)} - {("supply", None)}
        group, others = [actuator], []
        for things, members in groups:
            if things & shared:
                shared |= things
                group += members
            else:
                others.append((things, members))
        groups = [*others, (shared, group)]
    return [group for _, group in groups]


def _part(settings: MachineSettings, actuators: Group) -> MachineSettings:
    there = {actuator.bus for actuator in actuators}
    return replace(
        settings,
        actuators=tuple(actuators),
        buses={name: bus for name, bus in settings.buses.items() if name in there},
        wires={name: wire for name, wire in settings.wires.items() if name in there},
    )
