"""Places in the model to which an unexplained term can be added."""

from dataclasses import dataclass

from hil_emulator.identify.conclusion.findings import Unexplained
from hil_emulator.identify.prediction.free_terms.balances import (
    CELL,
    LEAKAGE,
    LOAD,
    PISTON,
    RULER,
    SPOOL,
    TAP_A,
    TAP_B,
)
from hil_emulator.model.declare import Stage
from hil_emulator.model.stages import (
    command,
    cross_leakage,
    dry_friction,
    friction,
    load,
    transducer,
)

TURN = 1e-3
"""Speed range in which a term with the sign of velocity changes its sign [m/s] (assumed)."""


@dataclass(frozen=True)
class TermPlace:
    """Place of a term in the model.

    Attributes:
        stage: the place in the equations.
        takes: arguments of the law, as Python code.
        regressor: the regressor computed from them, as Python code.
        value: result of the law, from the table's value `term`.
        equation: the law for a reader.
        channel: the sensor whose error it is; "" for a place in the plant.

    """

    stage: Stage
    takes: tuple[str, ...]
    regressor: str
    value: str
    equation: str
    channel: str = ""


_SIGN = f"math.tanh(velocity / {TURN!r})"


def _calibration(channel: str) -> TermPlace:
    """Return the place of a sensor's error over its reading."""
    return TermPlace(transducer, ("reading",), "reading", "reading + term", "y = x + T(x)", channel)


PLACES = {
    (PISTON.name, "velocity"): TermPlace(friction, ("velocity",), "velocity", "term", "F = T(v)"),
    (PISTON.name, "position"): TermPlace(friction, ("position",), "position", "term", "F = T(x)"),
    (PISTON.name, "position with the sign of velocity"): TermPlace(
        friction, ("velocity", "position"), f"position * {_SIGN}", "term", "F = T(x sign(v))"
    ),
    (PISTON.name, "pressure difference with the sign of velocity"): TermPlace(
        dry_friction, ("velocity", "pressure_a", "pressure_b"),
        "abs(pressure_a - pressure_b) * math.copysign(1.0, velocity)",
        "term * math.copysign(1.0, velocity)", "F = T(|p_a - p_b| sign(v))",
    ),
    (PISTON.name, "pressure sum with the sign of velocity"): TermPlace(
        dry_friction, ("velocity", "pressure_a", "pressure_b"),
        "(pressure_a + pressure_b) * math.copysign(1.0, velocity)",
        "term * math.copysign(1.0, velocity)", "F = T((p_a + p_b) sign(v))",
    ),
    (LOAD.name, "velocity"): TermPlace(load, ("velocity",), "velocity", "term", "F = T(v)"),
    (LOAD.name, "position"): TermPlace(load, ("position",), "position", "term", "F = T(x)"),
    (LEAKAGE.name, "pressure difference"): TermPlace(
        cross_leakage, ("pressure_a", "pressure_b"), "pressure_a - pressure_b", "term",
        "q = T(p_a - p_b)",
    ),
    (SPOOL.name, "valve current"): TermPlace(
        command, ("current",), "current", "current + term", "u = i + T(i)"
    ),
    (TAP_A.name, "measured pressure a"): _calibration("pressure_a"),
    (TAP_B.name, "measured pressure b"): _calibration("pressure_b"),
    (RULER.name, "measured position"): _calibration("position"),
    (CELL.name, "measured force"): _calibration("load_force"),
}  # fmt: skip
"""By balance and regressor. Other pairs have no place, because a stage offers few quantities:
leakage without the position, no stage of a chamber's flow, and no time."""


def place_of(term: Unexplained) -> TermPlace | None:
    """Return the place of a term in the model; None if it has no place."""
    return PLACES.get((term.balance, term.regressor))
