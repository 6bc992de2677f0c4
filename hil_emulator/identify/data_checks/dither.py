"""The dither of a driver, whose phase is in no log: the model of its mean current."""

import math
from collections.abc import Mapping

AMPLITUDE, FREQUENCY = "dither_amplitude", "dither_frequency"
"""Fields of the ripple of the current."""

THRESHOLD, HYSTERESIS = "threshold_current", "hysteresis_width"
"""Fields of what holds the spool at small changes of the current."""


def averaged(plant: Mapping[str, float]) -> tuple[dict[str, float], list[str]]:
    """Return the changes to a machine's parameters for the mean current, and the note on them.

    A ripple that exceeds half of the hysteresis cycles the iron, which then has no memory, and one
    that exceeds the threshold keeps the spool sliding.

    Args:
        plant: parameters by field name, SI.

    """
    amplitude = plant.get(AMPLITUDE, 0.0)
    if not amplitude:
        return {}, []
    note = (
        f"the driver's dither of {amplitude * 1e3:.3g} mA is averaged, because its phase is in no "
        "log: the set point is the mean current"
    )
    least = {HYSTERESIS: 0.5 * plant.get(HYSTERESIS, 0.0), THRESHOLD: plant.get(THRESHOLD, 0.0)}
    changes = {AMPLITUDE: 0.0} | {name: 0.0 for name, need in least.items() if amplitude >= need}
    if THRESHOLD in changes:
        ripple = amplitude * _spool_gain(plant)
        note += (
            f". The spool trembles by {ripple * 1e3:.2g} mA; what the readings show of that counts "
            "as a disagreement, so record with the dither off if you can"
        )
    return changes, [note]


def _spool_gain(plant: Mapping[str, float]) -> float:
    """Return the gain of the second-order spool at the frequency of the dither."""
    ratio = plant[FREQUENCY] / plant["valve_natural_frequency"]
    return 1.0 / math.hypot(1.0 - ratio**2, 2.0 * plant["valve_damping_ratio"] * ratio)
