"""Presliding: how far what is in contact bends along a measured path before it slides.

Seals slide after micrometres, the pads of a friction damper after millimetres.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_emulator.identify.measured.experiment import Array

RETREAT = 0.1
"""Way back from which a rod has reversed, over the presliding distance (assumed: it bends a seal by
little)."""

FOLLOWED = 0.01
"""Way back that a bend follows, over the presliding distance (assumed: it changes the direction by
a fiftieth)."""

LESS = 0.75
"""Part of the sum of squares up to which presliding leaves less than friction that slides at once
(assumed: nearly all is more)."""

FINER = 1.1
"""Ratio of the distances that are tried (assumed)."""

SHORTEST = 1e-5
"""Least of them [m] (assumed: guides slide after 10 to 50 um)."""

STROKES = 0.25
"""Largest of them over the travel: friction changes its direction within four distances."""


class Path(NamedTuple):
    """A measured motion, and the force that friction is a part of.

    Attributes:
        states: position [m], velocity [m/s], acceleration [m/s^2], shape (samples, 3).
        force: load force less that of the chambers [N], NaN where missing.

    """

    states: Array
    force: Array


def directions(position: Array, velocity: Array, distance: float) -> Array:
    """Return the direction z of dry friction along a path, -1 to 1 where it slides.

    dz/dx = (1 - z sign(v))/d (Dahl 1968), so that at z = 0 the stiffness is that of the model.

    Args:
        position: along the path [m].
        velocity: there [m/s].
        distance: presliding distance [m]; at the start nothing is bent.

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
    """Return where the rod turned, and the first and the last sample.

    It turned where it then went back by more than `retreat` [m]: a noisy reading turns with every
    sample.
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
    """Return the presliding distance that fits logs [m]; 0 if friction slides nearly at once.

    Each log is fitted by dry and viscous friction, inertia, a spring and a constant.
    """
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
    """Return the sum of squares that is left of the force [N^2]."""
    good = np.isfinite(path.force)
    rows = np.column_stack([direction, path.states, np.ones(len(direction))])[good]
    rows /= np.maximum(np.linalg.norm(rows, axis=0), 1e-30)
    rest = path.force[good] - rows @ np.linalg.lstsq(rows, path.force[good], rcond=None)[0]
    return float(rest @ rest)
