"""The few places where physics composes, in the order in which the balances meet them."""

from hil_emulator.model.declare import Stage

command = Stage(
    name="command",
    table="valve",
    takes=("current",),
    gives="current that drives the spool",
    unit="A",
    compose="chain",
)
spool = Stage(
    name="spool",
    table="valve",
    takes=("spool_speed",),
    gives="speed of the spool",
    unit="A/s",
    compose="chain",
)
metering = Stage(
    name="metering",
    table="valve",
    takes=("opening", "spool_position"),
    gives="opening of one metering edge",
    unit="A",
    compose="chain",
)
cross_leakage = Stage(
    name="cross_leakage",
    table="cylinder",
    takes=("pressure_a", "pressure_b"),
    gives="flow from chamber a to b",
    unit="m^3/s",
    compose="sum",
)
outward_leakage = Stage(
    name="outward_leakage",
    table="cylinder",
    takes=("pressure",),
    gives="flow from one chamber outwards",
    unit="m^3/s",
    compose="sum",
)
oil = Stage(
    name="oil",
    table="oil",
    takes=("bulk_modulus", "pressure"),
    gives="effective bulk modulus in a chamber",
    unit="Pa",
    compose="chain",
)
friction = Stage(
    name="friction",
    table="friction",
    takes=("velocity", "position", "pressure_a", "pressure_b"),
    gives="friction force of the seals, against the motion",
    unit="N",
    compose="sum",
)
stop = Stage(
    name="stop",
    table="cylinder",
    takes=("position", "velocity"),
    gives="force of the cylinder's ends on the rod",
    unit="N",
    compose="sum",
)
inertia = Stage(
    name="inertia",
    table="cylinder",
    takes=("position",),
    gives="mass that moves ahead of the load cell",
    unit="kg",
    compose="sum",
)
load = Stage(
    name="load",
    table="load",
    takes=("position", "velocity"),
    gives="force of the surroundings against the load",
    unit="N",
    compose="sum",
)
transducer = Stage(
    name="transducer",
    table="sensors",
    takes=("reading", "period", "normal"),
    gives="reading of one channel",
    unit="span",
    compose="chain",
)

CONTINUOUS = (
    command, spool, metering, cross_leakage, outward_leakage, oil, friction, stop, inertia, load,
)  # fmt: skip
SAMPLED = (transducer,)
