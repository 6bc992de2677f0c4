"""Quantities to vary so that similar effects can be distinguished.

A law that depends on a quantity differs from a law that does not, if the quantity is varied. This
serves benches that the model cannot drive: friction rigs, test machines, valve benches. Otherwise
see `next_experiment`.
"""

from collections.abc import Mapping, Sequence

from hil_emulator.model.declare import Effect

VARIED: dict[str, tuple[str, ...]] = {
    "at other chamber pressures": ("pressure_a", "pressure_b", "pressure", "port_pressure"),
    "at other supply pressures": ("supply_pressure", "pump_pressure", "port_s"),
    "at other pressure drops": ("drop", "valve_drop"),
    "at other speeds, slower and faster": ("velocity",),
    "over the whole stroke": ("position",),
    "with larger and smaller loads": ("stretch",),
    "with larger and smaller set points": ("opening", "current", "spool_position"),
    "with quicker and slower set points": ("spool_speed",),
    "with larger and smaller readings": ("reading",),
    "with the neighbouring channel moving": ("neighbour",),
    "at another oil temperature": ("oil_temperature",),
}
"""Instruction for a record, with the arguments of laws that it varies."""

LAST_RESORT: dict[str, tuple[str, ...]] = {"at another oil temperature": ("viscosity",)}
"""The same, if no other quantity distinguishes the effects."""

OTHERWISE = "with larger and smaller, quicker and slower motions"
"""The same for effects that depend on no such quantity."""


def variation(effects: Sequence[Effect]) -> str:
    """Return an instruction for a record that varies the quantities on which effects depend."""
    for varied in (VARIED, LAST_RESORT):
        if ways := [way for effect in effects for way in _looked_at(effect, varied)]:
            return " and ".join(dict.fromkeys(ways))
    return OTHERWISE


def contrast(one: Effect, others: Sequence[Effect]) -> str:
    """Return an instruction for a record that distinguishes an effect from others."""
    for varied in (VARIED, LAST_RESORT):
        mine = _looked_at(one, varied)
        theirs = [_looked_at(other, varied) for other in others]
        ways = [
            way for other in theirs for way in (*mine, *other) if (way in mine) != (way in other)
        ]
        ways = ways or [way for other in theirs for way in (*mine, *other)]
        if ways:
            return " and ".join(dict.fromkeys(ways))
    return OTHERWISE


def _looked_at(effect: Effect, varied: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Return instructions that vary the quantities on which the laws of an effect depend."""
    arguments = {a for law in effect.laws for a in law.arguments if isinstance(a, str)}
    return [way for way, names in varied.items() if arguments.intersection(names)]
