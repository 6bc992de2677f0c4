"""Channels that contradict physics in sign, size or clock: the contradictions in words."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls

from hil_emulator.identify.data_checks import clocks, magnitudes, unit_mistakes
from hil_emulator.identify.measured.experiment import Array, Experiment, Mask, noise_of
from hil_emulator.model.resonance import on_oil

CONTRARY = -0.3
"""Correlation below which two channels have opposite signs (assumed)."""

UNRELATED = 0.25
"""Correlation below which channels are unrelated (assumed; recordings of the reference machine with
large hidden effects had 0.5 and more)."""

RELATED = 0.7
"""Correlation needed to compare the sizes of two forces (assumed)."""

BETTER = 0.2
"""Gain in correlation from which two channels count as exchanged (assumed)."""

CLEAR = 5.0
"""Standard deviation over noise from which a channel has a signal (assumed)."""

AT_STOP = 0.005
"""Part of the stroke from either end at which the rod may rest against its stop (assumed)."""

FEWEST = 20
"""Samples needed for a correlation (assumed)."""


def hydraulic_force(experiment: Experiment, plant: Mapping[str, float]) -> Array:
    """Return A_p (p_a - alpha p_b) from the readings [N]; an absent chamber is at tank pressure."""
    tank = np.full(experiment.samples, plant.get("tank_pressure", 0.0))
    a = experiment.readings.get("pressure_a", tank)
    b = experiment.readings.get("pressure_b", tank)
    return np.asarray(plant["cylinder_piston_area"] * (a - plant["cylinder_area_ratio"] * b))


def _correlation(a: Array, b: Array) -> float:
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < FEWEST or np.std(a[good]) == 0.0 or np.std(b[good]) == 0.0:
        return 0.0
    return float(np.corrcoef(a[good], b[good])[0, 1])


def contradictions(experiments: Sequence[Experiment], plant: Mapping[str, float]) -> list[str]:
    """Return messages on wrong units, signs and clocks, and on unrelated channels."""
    messages = magnitudes.impossible(experiments, plant)
    if messages:
        likely = {e.name: unit_mistakes.balance(e, plant) for e in experiments}
        return messages + [f"{name}: {text}" for name, text in likely.items() if text]
    for e in experiments:
        messages += [f"{e.name}: {text}" for text in (_driven(e), _loaded(e, plant)) if text]
    return messages or clocks.two_clocks(
        experiments, lambda e: hydraulic_force(e, plant), on_oil(plant)
    )


def _driven(e: Experiment) -> str:
    """Return the contradiction between valve current and rod; "" if they agree."""
    if not len(e.current) or "position" not in e.readings:
        return ""
    velocity = clocks.motion(e, 1)
    along = clocks.likeness(e.current, velocity, e.period)
    against = clocks.likeness(-e.current, velocity, e.period)
    contrary = _correlation(e.current, velocity) < CONTRARY
    if contrary and against > max(RELATED, along):
        return (
            "the rod moves against the valve current; "
            "reverse the sign of position or of valve_current"
        )
    if contrary or along < UNRELATED:
        return (
            "the rod does not follow the valve current; are both of one recording, and in "
            "the right columns?"
        )
    return ""


def _loaded(e: Experiment, plant: Mapping[str, float]) -> str:
    """Return the contradiction between pressures and load cell; "" if they agree."""
    if "pressure_a" not in e.readings:
        return ""
    if "load_force" not in e.readings:
        return _exchanged(e, plant)
    measured = e.readings["load_force"]
    force = np.where(_at_stop(e, plant), np.nan, hydraulic_force(e, plant))
    if np.isfinite(force).sum() < FEWEST:
        return ""
    if _correlation(force, measured) < 2.0 * CONTRARY:
        return (
            "load force and pressures are opposite; reverse load_force, "
            "or exchange pressure_a and pressure_b"
        )
    if unbalanced := unit_mistakes.balance(e, plant):
        return unbalanced
    if "pressure_b" not in e.readings or not len(e.current):
        return ""
    if exchanged := _exchanged(e, plant):
        return exchanged
    alike = _accounted(force, [measured, *clocks.friction(e)])
    clear = all(np.nanstd(x) > CLEAR * noise_of(x) for x in (force, measured))
    if clear and alike < UNRELATED:
        return (
            "load_force does not follow the pressures; are both of one recording, and in "
            "the right columns?"
        )
    return _scale(force, measured) if _correlation(force, measured) > RELATED else ""


def _at_stop(e: Experiment, plant: Mapping[str, float]) -> Mask:
    """Return where an end of the stroke may carry the pressure force."""
    stroke = plant.get("cylinder_stroke", np.inf)
    place = e.readings.get("position", np.full(e.samples, np.nan)) / stroke
    return np.asarray((place < AT_STOP) | (place > 1.0 - AT_STOP))


def _exchanged(e: Experiment, plant: Mapping[str, float]) -> str:
    """Return a message if the two chambers' channels are exchanged; else ""."""
    if not {"pressure_b", "position"} <= set(e.readings) or not len(e.current):
        return ""
    columns = [clocks.motion(e, 2), e.readings["position"]]
    columns = [e.readings["load_force"]] if "load_force" in e.readings else columns
    swapped = e.readings | {
        "pressure_a": e.readings["pressure_b"], "pressure_b": e.readings["pressure_a"]
    }  # fmt: skip
    both = hydraulic_force(e, plant), hydraulic_force(replace(e, readings=swapped), plant)
    right, other = (_accounted(force, [*columns, *clocks.friction(e)]) for force in both)
    if other < right + BETTER or other < RELATED:
        return ""
    return "the pressures fit the motion if they change places; exchange pressure_a and pressure_b"


def _accounted(force: Array, columns: Sequence[Array]) -> float:
    """Return the correlation of the hydraulic force with a sum of other forces of any size.

    No force may enter with the wrong sign, because friction takes energy.
    """
    good = np.isfinite(force) & np.all([np.isfinite(c) for c in columns], axis=0)
    if good.sum() < FEWEST:
        return 0.0
    rows = np.column_stack([(c - np.mean(c[good]))[good] for c in columns])
    rows /= np.maximum(np.std(rows, axis=0), 1e-30)
    wanted = force[good] - np.mean(force[good])
    _, rest = nnls(rows, wanted)
    explained = 1.0 - rest**2 / max(float(np.sum(wanted**2)), 1e-30)
    return float(np.sqrt(max(explained, 0.0)))


def _scale(force: Array, measured: Array) -> str:
    """Return a message if two proportional forces differ by a unit; else ""."""
    good = np.isfinite(force) & np.isfinite(measured)
    ratio = float(np.std(measured[good]) / np.std(force[good]))
    if 1.0 / magnitudes.WRONG_UNIT_RATIO < ratio < magnitudes.WRONG_UNIT_RATIO:
        return ""
    return (
        f"load_force is {ratio:.2g} times what the pressures give"
        f"{unit_mistakes.likely('N', ratio)}; is its unit, or that of the pressures, right?"
    )
