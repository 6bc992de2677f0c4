"""Probes: constant terms in each balance, for derivatives by unknown terms.

They are declared like effects, in the kernel of identification only.
"""

from hil_emulator.model.declare import Effect, Param, effect
from hil_emulator.model.stages import command, cross_leakage, friction, load, outward_leakage, tank


def _knob(unit: str, size: float) -> Param:
    return Param("term", unit, "constant term", size, -1e30, 1e30, source="identification")


@effect(friction, knob=_knob("N", 1.0), source="identification", signature="force on the piston")
def probe_friction(term: float) -> float:
    """Add a constant: F = F + c."""
    return term


@effect(load, knob=_knob("N", 1.0), source="identification", signature="force on the load")
def probe_load(term: float) -> float:
    """Add a constant: F = F + c."""
    return term


@effect(cross_leakage, knob=_knob("m^3/s", 1e-9), source="identification", signature="a to b")
def probe_cross(term: float) -> float:
    """Add a constant: q = q + c."""
    return term


@effect(outward_leakage, knob=_knob("m^3/s", 1e-9), source="identification", signature="outwards")
def probe_outward(term: float) -> float:
    """Add a constant: q = q + c."""
    return term


@effect(command, knob=_knob("A", 1e-7), source="identification", signature="spool")
def probe_spool(current: float, term: float) -> float:
    """Add a constant: u = u + c."""
    return current + term


@effect(tank, knob=_knob("Pa", 1e3), source="identification", signature="return pressure")
def probe_return(port_pressure: float, term: float) -> float:
    """Add a constant: p = p + c."""
    return port_pressure + term


@effect(command, knob=_knob("A", 1e-7), source="identification", signature="spool")
def probe_drift(current: float, term: float) -> float:
    """Add the null drift, a state of the predictor: u = u + n.

    It acts on the spool, after delay and hold of the set point.
    """
    return current + term


PROBES: tuple[Effect, ...] = (
    probe_friction, probe_load, probe_cross, probe_outward, probe_spool,
    probe_return,
)  # fmt: skip
"""Probes for the balances."""

DRIFT = probe_drift
"""Null drift of the valve, a state of the predictor."""
