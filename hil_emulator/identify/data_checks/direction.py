"""Whether the position of a force balance counts along the force or against it, by friction."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear
from scipy.signal import savgol_filter

from hil_emulator.identify.data_checks.plausible import FEWEST, UNRELATED, hydraulic_force
from hil_emulator.identify.measured.experiment import Array, Experiment

SMOOTHING = 0.15
"""Time over which the speed is fitted [s] (assumed)."""

DRY_SPEED = 0.1
"""Speed of full dry friction, over the standard deviation of the speed (assumed)."""

BOTH_WAYS = 0.1
"""Least part of the travel in either direction, of a log that moves both ways (a negligible part).
"""

FAR_LESS = 0.5
"""Part of the sum of squares up to which a reversed position leaves far less (the larger part is
explained)."""

LESS = 0.9
"""The same from which it explains a negligible part more."""

AREA = 0.2
"""Relative error that a configured area of the piston may have (assumed: two tolerances of it)."""

CHECK = "not reversed. Check the signs of position and load_force"


class Opposed(NamedTuple):
    """How friction fits a log.

    Attributes:
        work: correlation of the force that moves the rod with its speed; positive in friction.
        both_ways: whether the rod moves both ways, so that a constant force is no friction.
        recorded: sum of squares that friction and inertia leave of that force [N^2].
        turned: the same if the position counts in the other direction.

    """

    work: float
    both_ways: bool
    recorded: float
    turned: float


def dissipative(
    experiments: Sequence[Experiment], plant: Mapping[str, float], driven: bool = False
) -> list[Experiment]:
    """Return force-balance experiments, with the position reversed if friction requires it.

    A test machine may count its position against extension. Friction would then drive the rod. The
    position is reversed if friction and inertia leave far less of the force then. Otherwise a note
    states the doubt. A log that moves one way only does not decide: there a constant force and
    friction are the same.

    Args:
        experiments: of one rig.
        plant: parameters by record field, SI.
        driven: whether the force is that of a drive, along the motion; what a rod passes on acts
            against it.

    """
    fits = [_opposed(e, plant, driven) for e in experiments]
    deciding = [fit for fit in fits if fit.both_ways]
    recorded, turned = sum(fit.recorded for fit in deciding), sum(fit.turned for fit in deciding)
    if turned < FAR_LESS * recorded:
        return [_reversed(e) for e in experiments]
    if turned < LESS * recorded:
        doubt = (
            "position: friction explains more of the force if position counts against extension, "
            f"but not far more; {CHECK}"
        )
        return [_noted(e, doubt) for e in experiments]
    if deciding:
        return list(experiments)
    one_way = (
        "position: the rod moves one way only, and the force drives it as friction cannot; a "
        f"constant force such as a weight does so, too; {CHECK}"
    )
    return [
        _noted(e, one_way) if fit.work < -UNRELATED else e
        for e, fit in zip(experiments, fits, strict=True)
    ]


def speed(experiment: Experiment) -> Array:
    """Return the velocity by sliding parabolas, NaN where the position is missing [m/s]."""
    position = experiment.readings["position"]
    good = np.isfinite(position)
    index = np.arange(len(position))
    filled = np.interp(index, index[good], position[good])
    width = min(max(5, round(SMOOTHING / experiment.period) // 2 * 2 + 1), len(position) // 2)
    width -= 1 - width % 2
    velocity = savgol_filter(filled, max(3, width), 2, deriv=1, delta=experiment.period)
    return np.asarray(np.where(good, velocity, np.nan))


def _opposed(e: Experiment, plant: Mapping[str, float], driven: bool) -> Opposed:
    """Return how friction fits a log, with any constant force and any linear spring."""
    v, hydraulic = speed(e), hydraulic_force(e, plant)
    moving = hydraulic - e.readings["load_force"]
    if driven:
        moving = -moving
    dry = np.tanh(v / max(DRY_SPEED * float(np.nanstd(v)), 1e-12))
    forces = [v, dry, np.gradient(v, e.period), hydraulic, moving, e.readings["position"]]
    columns = np.column_stack(forces)
    columns = columns[np.isfinite(columns).all(axis=1)]
    if len(columns) < FEWEST:
        return Opposed(0.0, False, 0.0, 0.0)
    v, moving = columns[:, 0], columns[:, 4]
    work = float(v @ moving) / max(float(np.linalg.norm(v) * np.linalg.norm(moving)), 1e-30)
    forth, back = float(np.sum(v[v > 0.0])), -float(np.sum(v[v < 0.0]))
    both_ways = min(forth, back) > BOTH_WAYS * (forth + back)
    springs = np.column_stack([np.ones(len(v)), columns[:, 5]])
    rest = columns[:, :5] - springs @ np.linalg.lstsq(springs, columns[:, :5], rcond=None)[0]
    rest[:, :3] /= np.maximum(np.linalg.norm(rest[:, :3], axis=0), 1e-30)
    return Opposed(work, both_ways, _left(rest), _left(rest * [-1.0, -1.0, -1.0, 1.0, 1.0]))


def _left(rest: Array) -> float:
    """Return the sum of squares that opposing forces leave of the last column [N^2].

    Two parts of friction and the inertia have factors of at least zero; that of the hydraulic force
    has the tolerance of an area.
    """
    bounds = [0.0, 0.0, 0.0, -AREA], [np.inf, np.inf, np.inf, AREA]
    return 2.0 * float(lsq_linear(rest[:, :4], rest[:, 4], bounds, "bvls").cost)


def _reversed(e: Experiment) -> Experiment:
    position = e.readings["position"]
    turned = float(np.nanmax(position) + np.nanmin(position)) - position
    note = "position: friction would drive the rod, so position counts against extension; reversed"
    return _noted(replace(e, readings=e.readings | {"position": turned}), note)


def _noted(e: Experiment, note: str) -> Experiment:
    return replace(e, notes=(*e.notes, note))
