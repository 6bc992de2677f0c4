"""The few places where physics composes, in the order in which the balances meet them."""

from hil_emulator.model.declare import Stage

command = Stage("command", "valve", ("current",), "current that drives the spool", "A", "chain")
spool = Stage("spool", "valve", ("spool_speed",), "speed of the spool", "A/s", "chain")
metering = Stage(
    "metering", "valve", ("opening", "spool_position"), "opening of one metering edge", "A", "chain"
)
cross_leakage = Stage(
    "cross_leakage", "cylinder", ("pressure_a", "pressure_b"), "flow from a to b", "m^3/s", "sum"
)
outward_leakage = Stage(
    "outward_leakage", "cylinder", ("pressure",), "flow from one chamber outwards", "m^3/s", "sum"
)
oil = Stage(
    "oil", "oil", ("bulk_modulus", "pressure"), "effective bulk modulus of a chamber", "Pa", "chain"
)
friction = Stage(
    "friction",
    "friction",
    ("velocity", "position", "pressure_a", "pressure_b"),
    "friction force of the seals, against the motion",
    "N",
    "sum",
)
stop = Stage(
    "stop",
    "cylinder",
    ("position", "velocity"),
    "force of the cylinder's ends on the rod",
    "N",
    "sum",
)
inertia = Stage(
    "inertia", "cylinder", ("position",), "mass that moves ahead of the load cell", "kg", "sum"
)
load = Stage(
    "load",
    "load",
    ("position", "velocity"),
    "force of the surroundings against the load",
    "N",
    "sum",
)
transducer = Stage(
    "transducer", "sensors", ("reading", "period", "normal"), "reading of one channel", "", "chain"
)

CONTINUOUS = (
    command, spool, metering, cross_leakage, outward_leakage, oil, friction, stop, inertia, load,
)  # fmt: skip
SAMPLED = (transducer,)
