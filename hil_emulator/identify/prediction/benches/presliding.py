"""Presliding: deflection of a frictional contact before gross sliding, along a measured path.

The presliding distance of seals is micrometres, that of friction damper pads millimetres.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_emulator.identify.measured.experiment import Array

RETREAT = 0.1
"""Backward travel that counts as a reversal, over the presliding distance (assumed)."""

FOLLOWED = 0.01
"""Backward travel that changes the deflection, over the presliding distance (assumed; less changes
the friction by below 2 %)."""

LESS = 0.75
"""Ratio of sums of squares, with over without presliding, below which presliding is modelled
(assumed)."""

FINER = 1.1
"""Ratio of successive distances of the search (assumed)."""

SHORTEST = 1e-5
"""Smallest distance of the search [m] (assumed; guides slide after 10 to 50 um)."""

MOST = 20_000
"""Largest number of evenly chosen samples per log."""

STROKES = 0.25
"""Largest distance of the search over the travel: friction changes sign within four distances."""


class Path(NamedTuple):
    """A measured motion, and the force of friction, inertia and load.

    Attributes:
        states: position [m], velocity [m/s], acceleration [m/s^2], shape (samples, 3).
        force: load force minus that of the chambers [N], NaN where missing.

    """

    states: Array
    force: Array


def directions(position: Array, velocity: Array, distance: float) -> Array:
    """Return dry friction over its sliding value along a path, from -1 to 1.

    Dahl's model: dz/dx = (1 - z sign(v))/d (Dahl 1968), with the model's stiffness at z = 0.

    Args:
        position: along the path [m].
        velocity: there [m/s].
        distance: presliding distance [m]; the deflection at the start is zero.

    """
    edges = reversals(position, velocity, FOLLOWED * distance)
    along = np.zeros(len(position))
    for begin, end in pairwise(edges):
        part = slice(begin, end + 1)
        sense = math.copysign(1.0, position[end] - position[begin])
        way = np.maximum.accumulate(sense * (position[part] - position[begin]))
        along[part] = sense + (along[begin] - sense) * np.exp(-way / distance)
    return along


def reversals(position: Array, velocity: Array, retreat: float) -> NDArray[np.int64]:
    """Return the samples of reversals, with the first and the last sample.

    Args:
        position: along the path [m].
        velocity: there [m/s].
        retreat: backward travel that counts as a reversal [m], to ignore noise.

    """
    kept, onwards = [0], 0.0
    for i in (*(np.flatnonzero(np.diff(np.sign(velocity))) + 1), len(position) - 1):
        moved = position[i] - position[kept[-1]]
        if moved * onwards > 0.0:
            kept[-1] = int(i)
        elif abs(moved) > retreat:
            kept.append(int(i))
            onwards = moved
    return np.array([*kept[:-1], len(position) - 1] if len(kept) > 1 else [0, len(position) - 1])


def distance_of(paths: Sequence[Path]) -> float:
    """Return the presliding distance with the best fit [m]; 0 if presliding improves it little.

    Each log is fitted by dry and viscous friction, inertia, a spring and a constant force.
    """
    paths = [Path(*(part[:: -(-len(part) // MOST)] for part in path)) for path in paths]
    travel = max(float(np.ptp(path.states[:, 0])) for path in paths)
    count = max(0, int(math.log(STROKES * travel / SHORTEST) / math.log(FINER)))
    distances = SHORTEST * FINER ** np.arange(count)
    at_once = sum(_left(path, np.sign(path.states[:, 1])) for path in paths)
    left = [
        sum(_left(path, directions(path.states[:, 0], path.states[:, 1], d)) for path in paths)
        for d in distances.tolist()
    ]
    if not left or min(left) > LESS * at_once:
        return 0.0
    return float(distances[int(np.argmin(left))])


def _left(path: Path, direction: Array) -> float:
    """Return the residual sum of squares of the force [N^2]."""
    good = np.isfinite(path.force)
    rows = np.column_stack([direction, path.states, np.ones(len(direction))])[good]
    rows /= np.maximum(np.linalg.norm(rows, axis=0), 1e-30)
    rest = path.force[good] - rows @ np.linalg.lstsq(rows, path.force[good], rcond=None)[0]
    return float(rest @ rest)
