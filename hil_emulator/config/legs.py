"""Legs: actuators whose loads are links, the one carrying the joint of the other."""

from collections.abc import Sequence
from dataclasses import replace

from hil_emulator.config.actuators import ActuatorSettings
from hil_emulator.errors import UserError

_LENGTH = "rotary_joint_link_length"


def with_legs(place: str, actuators: Sequence[ActuatorSettings]) -> tuple[ActuatorSettings, ...]:
    """Return the actuators, each followed by the one that it carries, in the order of the model.

    Args:
        place: of the machine's description.
        actuators: its actuators.

    Raises:
        UserError: if an actuator cannot carry the named one.

    """
    by_name = {a.name: a if a.carries else _carrying_nothing(a) for a in actuators}
    carried = [a.carries for a in actuators if a.carries]
    ordered: list[ActuatorSettings] = []
    for actuator in by_name.values():
        if actuator.carries:
            _check(f"{place}: actuator {actuator.name}", actuator, by_name, carried)
        if actuator.name not in carried:
            ordered += [actuator, *([by_name[actuator.carries]] if actuator.carries else [])]
    return tuple(ordered)


def _carrying_nothing(actuator: ActuatorSettings) -> ActuatorSettings:
    """Return an actuator whose link carries no joint, whatever its length."""
    plant = {name: v for name, v in actuator.config.plant.items() if name != _LENGTH}
    return replace(actuator, config=replace(actuator.config, plant=plant))


def _check(
    place: str, one: ActuatorSettings, by_name: dict[str, ActuatorSettings], carried: list[str]
) -> None:
    """Refuse an impossible leg."""
    assert one.carries
    other = by_name.get(one.carries)
    if other is None:
        raise UserError(f"{place}: carries '{one.carries}'; there are: {', '.join(by_name)}")
    if other.carries or one.name in carried or carried.count(other.name) > 1:
        raise UserError(f"{place}: a leg has two joints: one actuator that carries one other")
    if one.supply is None or one.supply != other.supply:
        raise UserError(
            f"{place}: carries {other.name}, so both are computed together: give both the same "
            "supply"
        )
    joints = [
        [a.config.plant.get(f"rotary_joint_{n}", 0.0) for n in ("inertia", "mass_moment")]
        for a in (one, other)
    ]
    length = one.config.plant.get(_LENGTH, 0.0)
    if not (joints[0][0] and joints[1][0] and length):
        raise UserError(
            f"{place}: carries {other.name}, so [load.rotary_joint] is wanted in the files of "
            'both, here with link_length = "350 mm" from joint to joint'
        )
    if joints[0][0] * joints[1][0] <= (length * joints[1][1]) ** 2:
        raise UserError(
            f"{place}: its rotary_joint.inertia lacks the mass of what it carries: add the mass of "
            f"{other.name}'s link times link_length squared, and to mass_moment that mass times "
            "link_length"
        )
