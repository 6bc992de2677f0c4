"""Plant faults: a changed parameter of the model.

Each is a function of the parameter's configured value and the strength s of the fault.
"""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass

from hil_emulator.faults.declare import FaultKind, FaultParam, Layer
from hil_emulator.faults.strength import Change

SUPPLY = "supply"
"""Target of faults that act on all actuators of a supply."""

LOWEST_SUPPLY = 1e5
"""Lowest supply pressure of a pump at rest: the atmosphere [Pa]."""


@dataclass(frozen=True)
class PlantFaultKind(FaultKind):
    """A kind of fault in the plant.

    Attributes:
        parameter: the parameter of the model that it changes.

    """

    layer = Layer.PLANT
    begin: Callable[..., Change]
    _: KW_ONLY
    parameter: str


def plant_fault(
    target: str, parameter: str, *params: FaultParam
) -> Callable[[Callable[..., Change]], PlantFaultKind]:
    """Declare the decorated function as a fault of a part of the plant."""

    def declare(begin: Callable[..., Change]) -> PlantFaultKind:
        return PlantFaultKind(begin, (target,), params, parameter=parameter)

    return declare


@plant_fault(
    SUPPLY, "supply_pressure",
    FaultParam("pressure", "Pa", "remaining supply pressure", 1e5, 0.0, 400e5, "bar"),
)  # fmt: skip
def loss(pressure: float) -> Change:
    """The pump stops."""
    return lambda sound, s: sound + s * (pressure - sound)


@plant_fault(
    SUPPLY, "supply_pressure",
    FaultParam("drop", "Pa", "reduction of the supply pressure", 40e5, 0.0, 400e5, "bar", True),
)  # fmt: skip
def droop(drop: float) -> Change:
    """The supply sags."""
    return lambda sound, s: max(LOWEST_SUPPLY, sound - s * drop)


@plant_fault(
    "cylinder", "internal_leakage_conductance",
    FaultParam("conductance", "m^3/(s*Pa)", "additional leakage", 2e-12, 0.0, 1e-9),
)  # fmt: skip
def leak(conductance: float) -> Change:
    """Oil passes the worn piston seal."""
    return lambda sound, s: sound + s * conductance


@plant_fault(
    "cylinder", "coulomb_friction_force",
    FaultParam("force", "N", "additional Coulomb friction", 500.0, 0.0, 1e5),
)  # fmt: skip
def friction_jump(force: float) -> Change:
    """The seal or the guide seizes."""
    return lambda sound, s: sound + s * force


@plant_fault(
    "oil", "entrained_air_fraction",
    FaultParam("fraction", "1", "additional air, volume at 1 atm", 0.05, 0.0, 0.2, "%"),
)  # fmt: skip
def air(fraction: float) -> Change:
    """The oil foams."""
    return lambda sound, s: sound + s * fraction


@plant_fault("valve", "spool_rate_limit_rate")
def stuck() -> Change:
    """The spool stays where it is."""
    return lambda sound, s: 0.0 if s else sound


@plant_fault(
    "valve", "valve_gain",
    FaultParam("share", "1", "share of the flow that is lost", 0.5, 0.0, 1.0, "%"),
)  # fmt: skip
def clogged(share: float) -> Change:
    """Dirt in the valve's passages."""
    return lambda sound, s: sound * (1.0 - s * share)


@plant_fault(
    "valve", "spool_rate_limit_rate",
    FaultParam("rate", "A/s", "largest speed of the spool", 0.01, 1e-4, 100.0),
)  # fmt: skip
def slow(rate: float) -> Change:
    """Varnish brakes the spool."""
    return lambda sound, s: min(sound, rate / s) if s else sound


@plant_fault("lines", "lines_closed")
def shut() -> Change:
    """The shut-off valves between valve and cylinder close."""
    return lambda sound, s: max(sound, s)


KINDS = (loss, droop, leak, friction_jump, air, stuck, clogged, slow, shut)

FAULTY_PARAMETERS = frozenset(kind.parameter for kind in KINDS)
"""Parameters that faults can change, whether the configuration has them on or off."""
