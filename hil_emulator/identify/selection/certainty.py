"""How certain the value of an effect is, and which are too faint for one that is not.

Every machine has a little of everything, like friction that ripples along the stroke. What explains
hardly anything is named only where it can be nothing else.
"""

import math
from statistics import NormalDist

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.selection.progress import Search

FAINT = 0.005
"""Share of the innovations' variance below which an effect needs a law that fits and a value that
differs from none (assumed)."""

NORMAL_95 = 1.96
"""Standard deviations to either end of a 95 % interval."""


def faint(search: Search) -> list[str]:
    """Return the effects that explain next to nothing, and may as well be something else or none.

    Args:
        search: finished, with what speaks against the laws of its effects.

    """
    least = FAINT * search.rounds[-1].base.sample_size
    return [c.name for c in search.effects
            if search.selected_in(c.name).best < least
            and (c.name in search.forms or _may_be_none(search, c.name))]  # fmt: skip


def deviation(search: Search, fit: Fit, name: str) -> float:
    """Return the standard deviation of an effect's coordinate, everything counted.

    Args:
        search: with the effect in the model.
        fit: of the model.
        name: of the effect.

    """
    i = [c.name for c in fit.coordinates].index(name)
    spread = float(np.sqrt(fit.covariance()[i, i]))
    found = max(spread, search.selected_in(name).trials[0].deviation)
    return math.hypot(found, discrepancy_uncertainty(search, fit)[i])


def interval(search: Search, fit: Fit, name: str) -> tuple[float, float]:
    """Return the 95 % interval of an effect's coordinate, given that the effect is there.

    That it is there, on this side of none, has passed a test; what no law explains leaves its size
    uncertain. So the normal distribution ends at none.
    """
    at = float(fit.at[[c.name for c in fit.coordinates].index(name)])
    size = NormalDist(abs(at), deviation(search, fit, name))
    absent = size.cdf(0.0)
    ends = [size.inv_cdf(absent + (1.0 - absent) * part) for part in (0.025, 0.975)]
    low, high = sorted(math.copysign(end, at) for end in ends)
    return low, high


def discrepancy_uncertainty(search: Search, fit: Fit) -> Array:
    """Return the standard deviation of each coordinate that comes from what no law explains.

    Friction that changes along the stroke, say, is taken for something else in part: how much, its
    strength tells, while its shape is anyone's. Noise that is estimated holds it already.
    """
    if fit.effective is not None:
        return np.zeros(len(fit.coordinates))
    last = search.rounds[-1]
    names = [c.name for c in last.base.coordinates]
    found = [dict(zip(names, t.uncertainty, strict=True)) for t in last.terms if len(t.uncertainty)]
    return np.array([np.linalg.norm([d.get(c.name, 0.0) for d in found])
                     for c in fit.coordinates])  # fmt: skip


def _may_be_none(search: Search, name: str) -> bool:
    fit = search.rounds[-1].base
    at = fit.at[[c.name for c in fit.coordinates].index(name)]
    return bool(abs(at) < NORMAL_95 * deviation(search, fit, name))
