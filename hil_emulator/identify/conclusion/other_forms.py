"""Base laws whose form in the machine differs from the form in the configuration."""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import is_usual
from hil_emulator.model.law_forms import USUAL
from hil_emulator.units import show

SIGNIFICANT = 3.3
"""Ratio of a difference and its uncertainty that excludes chance, p < 0.001."""


def other_forms(fit: Fit) -> list[str]:
    """Return a sentence for each base law whose form differs significantly from the model's.

    Args:
        fit: of the model, with the usual effects among its parameters.

    """
    deviations = np.sqrt(np.diag(fit.covariance()))
    return [_words(c, at) for c, at, deviation in zip(fit.coordinates, fit.at, deviations,
            strict=True) if is_usual(c) and at > SIGNIFICANT * deviation]  # fmt: skip


def _words(c: Coordinate, at: float) -> str:
    law = next(u.law for u in USUAL if u.name == c.name)
    value, usual = (show(float(f"{c.value(x):.3g}"), c.unit, c.shown) for x in (at, 1.0))
    return (
        f"{law}: this law has another form here than in the configuration, {c.name} = {value}; "
        f"{usual} is usual, and the difference is taken into account"
    )
