"""A machine without friction of the spool, hysteresis and dead band, for linear models."""

import math
from collections.abc import Mapping

FRICTION_OF_SPOOL = {"threshold_current": "threshold", "hysteresis_width": "hysteresis"}
"""Effects that hold the spool at small changes of the current, by field."""

DITHER = "dither_amplitude"
"""Field of the current's ripple, with which there is no rest."""

COMPENSATOR = "pressure_compensator_setting"
"""Field of the pressure difference that a compensator keeps over an edge."""

OVERLAP, JUMP = "overlap_lap", "dead_band_compensation_jump"
"""Fields of the travel before an edge opens, and of the jump over it."""


def sliding(values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of the same valve whose spool slides freely."""
    return {**values, **dict.fromkeys((*FRICTION_OF_SPOOL, DITHER), 0.0)}


def at_the_edge(values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of the same valve at the edges of its dead band: lands without overlap.

    A driver with dead-band compensation jumps from one edge to the other. An edge with gain g and
    lap l opens with g (u - l) - z; for u = z + v this is g (v - l - z/g + z).
    """
    lap = values.get(OVERLAP, 0.0)
    laps = {
        f"lap_{edge}_lap": values.get(f"lap_{edge}_lap", 0.0)
        + lap * (1.0 / (1.0 + values.get(f"gain_{edge}_excess", 0.0)) - 1.0)
        for edge in ("sa", "at", "sb", "bt")
    }
    return {**values, **(laps if lap else {}), OVERLAP: 0.0, JUMP: 0.0}


def left_out(values: Mapping[str, float], *, at_rest: bool) -> list[str]:
    """Return the effects that a linear model of a machine leaves out, one sentence each.

    Args:
        values: parameters by field name, SI.
        at_rest: whether it is the linear model at rest.

    """
    names = [name for field, name in FRICTION_OF_SPOOL.items() if values.get(field, 0.0)]
    sentences = []
    if names:
        sentences.append(
            f"{' and '.join(names).capitalize()}: the spool slides. Currents that change by less "
            "do not move it."
        )
    if values.get(DITHER, 0.0):
        sentences.append("Dither: the model is that of the mean current.")
    if math.isfinite(values.get(COMPENSATOR, math.inf)):
        sentences.append("Compensator: exact has it, S1 and complete do not.")
    lap = values.get(OVERLAP, 0.0)
    if lap and at_rest:
        sentences.append(
            f"Overlap: the model holds at the edges of the dead band, where a driver that "
            f"compensates it works. Within ±{lap * 1e3:.4g} mA only leakage passes the valve."
        )
    return sentences
