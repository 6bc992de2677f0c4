"""What can be hidden in the blind plant: effects with their sizes, and what no catalogue has."""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Hidden:
    """An effect that can be hidden.

    Attributes:
        key: its name in the blind plant.
        name: what the product's catalogue calls it.
        medium: medium size on the first bench, SI.
        grows: powers of a machine's scales with which it grows, see `benches.Bench.over`.
        signed: whether it occurs in both senses.
        inverse: whether the catalogue states the reciprocal.

    """

    key: str
    name: str
    medium: float
    grows: tuple[tuple[str, int], ...] = ()
    signed: bool = False
    inverse: bool = False

    def knob(self, size: float) -> float:
        """Return the catalogue's value of a size."""
        return 1.0 / size if self.inverse else size


EFFECTS = {
    hidden.key: hidden
    for hidden in (
        Hidden("null_bias", "null_bias", 1e-4, (("current", 1),), signed=True),
        Hidden("overlap", "overlap", 1.2e-4, (("current", 1),)),
        Hidden("gain_asymmetry", "gain_asymmetry", 0.06, signed=True),
        Hidden("flow_saturation", "flow_saturation", 1 / 6e-3, (("current", -1),), inverse=True),
        Hidden("hysteresis", "hysteresis", 1.2e-4, (("current", 1),)),
        Hidden("transport_delay", "transport_delay", 1.5e-3, (("time", 1),)),
        Hidden("variable_pump", "variable_pump", 1 / 5.5e-5, (("flow", -1),), inverse=True),
        Hidden("back_pressure", "back_pressure", 2e14, (("flow", -2),)),
        Hidden("internal_leakage", "internal_leakage", 1.5e-13, (("flow", 1),)),
        Hidden("external_leakage", "external_leakage", 2e-14, (("flow", 1),)),
        Hidden("stribeck", "stribeck_friction", 35.0, (("force", 1),)),
        Hidden("friction_asymmetry", "friction_asymmetry", 0.12, signed=True),
        Hidden("pressure_friction", "pressure_friction", 3e-6, (("area", 1),)),
        Hidden("position_friction", "position_friction", 0.4),
        Hidden("load_spring", "load_spring", 2e3, (("force", 1), ("length", -1))),
        Hidden("gravity", "gravity", 60.0, (("force", 1),), signed=True),
        Hidden("pressure_a.offset", "pressure_a.offset", 1e5, (("pressure", 1),), signed=True),
        Hidden("pressure_b.gain_error", "pressure_b.gain_error", 0.01, signed=True),
        Hidden("position.delay", "position.delay", 1.5e-3, (("time", 1),)),
        Hidden("load_force.offset", "load_force.offset", 30.0, (("force", 1),), signed=True),
        Hidden("load_force.gain_error", "load_force.gain_error", 0.03, signed=True),
    )
}
"""Effects of the catalogue; sizes are those of a worn or badly set machine, not of a broken one."""

OUTSIDE = {
    "place_leak": 1e-13, "crack_leak": 3e-13, "blocked_spool": 1.2e-3, "jam": 60.0, "drag": 5e3,
    "burst": 60.0, "one_way_damper": 5e3, "tap_resonance": 1.2e-3, "cell_crosstalk": 4e-6,
}  # fmt: skip
"""Effects that no entry of the catalogue describes, with their sizes, SI.

A leak in one half of the stroke; a leak that opens at 20 bar; a spool that cannot go beyond a
place on one side; a tight spot; friction with the square of speed; blows against the load; a
damper that brakes one way, with the square of speed; a sensor at the end of a ringing line (its
time over 2 pi); pressure that bends the load cell.
"""

OUTSIDE_GROWS = {
    "place_leak": (("flow", 1),), "crack_leak": (("flow", 1),), "blocked_spool": (("current", 1),),
    "jam": (("force", 1),), "drag": (("force", 1), ("speed", -2)), "burst": (("force", 1),),
    "one_way_damper": (("force", 1), ("speed", -2)), "tap_resonance": (("time", 1),),
    "cell_crosstalk": (("area", 1),),
}  # fmt: skip
"""With which powers of a machine's scales they grow."""

SITS = {
    "place_leak": ("leakage", "chamber"),
    "crack_leak": ("leakage", "chamber"),
    "blocked_spool": ("spool", "chamber"),
    "jam": ("piston",),
    "drag": ("piston",),
    "burst": ("force on the load",),
    "one_way_damper": ("force on the load",),
    "tap_resonance": ("pressure a", "chamber a"),
    "cell_crosstalk": ("load cell",),
}
"""Words of the balances in which each of them sits: a leak to the other chamber is part of three,
an error of a pressure's sensor looks like a flow into that chamber."""


def size_on(key: str, scales: Mapping[str, float]) -> float:
    """Return how many times as large an effect is as on the first bench.

    Args:
        key: of an effect, or of what no catalogue has.
        scales: of the machine, see `benches.Bench.over`.

    """
    grows = EFFECTS[key].grows if key in EFFECTS else OUTSIDE_GROWS[key]
    return math.prod(scales[what] ** power for what, power in grows)
