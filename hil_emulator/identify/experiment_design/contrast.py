"""What to vary so that effects which look alike part: what one law looks at and the other does not.

Where an experiment can be forecast, `next_experiment` says which; this is for benches of which the
model drives nothing: friction rigs, test machines, valve benches.
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
"""How a record is made that shows what a law looks at, and the arguments that say so."""

LAST_RESORT: dict[str, tuple[str, ...]] = {"at another oil temperature": ("viscosity",)}
"""The same, where nothing else tells effects apart."""


def contrast(one: Effect, others: Sequence[Effect]) -> str:
    """Return how to record so that an effect parts from others, in words."""
    for known in (VARIED, LAST_RESORT):
        mine = _looked_at(one, known)
        theirs = [_looked_at(other, known) for other in others]
        ways = [
            way for other in theirs for way in (*mine, *other) if (way in mine) != (way in other)
        ]
        ways = ways or [way for other in theirs for way in (*mine, *other)]
        if ways:
            return " and ".join(dict.fromkeys(ways))
    return "with larger and smaller, quicker and slower motions"


def _looked_at(effect: Effect, known: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Return how to vary what the laws of an effect look at."""
    arguments = {a for law in effect.laws for a in law.arguments if isinstance(a, str)}
    return [way for way, names in known.items() if arguments.intersection(names)]
