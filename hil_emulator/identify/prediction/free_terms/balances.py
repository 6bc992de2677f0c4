"""Balances of the machine, and the regressors of their free terms."""

from dataclasses import dataclass

from hil_emulator.model import stages


@dataclass(frozen=True)
class Balance:
    """An equation to which a term can be added.

    Attributes:
        name: in words, as in the model's stages.
        unit: of the term.
        scale: typical size of a term.
        probes: weight of each probe.
        channel: sensor channel, if the term is a sensor error; else "".

    """

    name: str
    unit: str
    scale: float
    probes: tuple[tuple[str, float], ...] = ()
    channel: str = ""


SPOOL = Balance(stages.SPOOL, "A", 1e-5, (("probe_spool", 1.0),))
FLOW_A = Balance(stages.FLOW_A, "m^3/s", 1e-7, (("probe_cross", -0.5), ("probe_outward", -0.5)))
FLOW_B = Balance(stages.FLOW_B, "m^3/s", 1e-7, (("probe_cross", -0.5), ("probe_outward", 0.5)))
LEAKAGE = Balance(stages.LEAKAGE, "m^3/s", 1e-7, (("probe_cross", 1.0),))
NULL_FLOW = Balance(stages.NULL_FLOW, "m^3/s", 1e-7)
PISTON = Balance(stages.PISTON, "N", 10.0, (("probe_friction", 1.0),))
LOAD = Balance(stages.LOAD, "N", 10.0, (("probe_load", 1.0),))
RETURN = Balance(stages.RETURN, "Pa", 1e4, (("probe_return", 1.0),))
SUPPLY = Balance(stages.SUPPLY, "Pa", 1e5)
TAP_A = Balance("reading of the sensor of pressure a", "Pa", 1e4, channel="pressure_a")
TAP_B = Balance("reading of the sensor of pressure b", "Pa", 1e4, channel="pressure_b")
CELL = Balance("reading of the load cell", "N", 10.0, channel="load_force")
RULER = Balance("reading of the position sensor", "m", 1e-5, channel="position")

TERMS: tuple[tuple[Balance, str], ...] = (
    (SPOOL, "valve current"), (SPOOL, "rate of the current"),
    (FLOW_A, "spool position"), (FLOW_A, "pressure a"), (FLOW_A, "position"),
    (FLOW_B, "spool position"), (FLOW_B, "pressure b"), (FLOW_B, "position"),
    (LEAKAGE, "pressure difference"), (LEAKAGE, "position times pressure difference"),
    (NULL_FLOW, "spool position"),
    (PISTON, "velocity"), (PISTON, "position"), (PISTON, "position with the sign of velocity"),
    (PISTON, "pressure difference with the sign of velocity"),
    (PISTON, "pressure sum with the sign of velocity"), (PISTON, "time"),
    (LOAD, "velocity"), (LOAD, "position"), (LOAD, "time"),
    (SUPPLY, "supply flow"), (RETURN, "return flow"),
    (TAP_A, "time"), (TAP_A, "measured pressure a"), (TAP_A, "rate of pressure a"),
    (TAP_A, "second derivative of pressure a"),
    (TAP_B, "time"), (TAP_B, "measured pressure b"), (TAP_B, "rate of pressure b"),
    (TAP_B, "second derivative of pressure b"),
    (CELL, "time"), (CELL, "measured force"), (CELL, "pressure sum"),
    (RULER, "measured position"), (RULER, "velocity"), (RULER, "acceleration"),
)  # fmt: skip
"""Balance and regressor of every free term. The spool over time is missing, since the null drift is
a state of the predictor."""
