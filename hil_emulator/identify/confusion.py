"""Which effects these data cannot tell apart."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.scan import Score
from hil_emulator.identify.search import Trial

INSEPARABLE = 12.0
"""Difference in chi-square below which two explanations count as the same (assumed)."""


def separability(chosen: Score, rival: Score, size: float) -> float:
    """Return by how much chi-square grows if the rival takes the place of the chosen effect.

    D = theta² (G_ii - G_ij²/G_jj) with the projected columns' products G (size in typical units).
    """
    inner = float(chosen.column.astype(np.float64) @ rival.column.astype(np.float64))
    if rival.information <= 0.0:
        return size**2 * chosen.information
    return size**2 * (chosen.information - inner**2 / rival.information)


def rivals_of(best: Trial, scores: Sequence[Score]) -> tuple[list[str], float | None]:
    """Return the effects that cannot be told from the best, and the size that would separate.

    Args:
        best: the named effect.
        scores: the round in which it was named.

    """
    chosen = best.score
    size = float(best.fit.at[-1])
    found, worst = [], 0.0
    for rival in scores:
        if rival.coordinate is chosen.coordinate or rival.statistic < 0.5 * chosen.statistic:
            continue
        distance = separability(chosen, rival, size)
        if distance < INSEPARABLE:
            found.append(rival.coordinate.name)
        share = distance / size**2 if size else 0.0
        if share > 0.0:
            worst = max(worst, float(np.sqrt(INSEPARABLE / share)))
    span = abs(chosen.coordinate.scale)
    return found, worst * span if worst else None
