"""Base laws whose form in the machine differs from the form in the model."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import is_usual
from hil_emulator.identify.prediction.residuals.huber import tamed
from hil_emulator.model.law_forms import USUAL
from hil_emulator.units import show

NOTICEABLE = 1.0
"""Smallest reported difference, in standard deviations of published forms."""

SIGNIFICANT = 3.3
"""Ratio of a difference and its uncertainty that excludes chance, p < 0.001."""

MOST_FORMS = 3.0
"""Difference beyond all published forms, in their standard deviations (p = 0.003)."""


def other_forms(predictor: Predictor, frozen: Sequence[object], fit: Fit) -> list[str]:
    """Return a sentence for each base law whose form differs noticeably from the model's.

    Args:
        predictor: that has frozen the experiments.
        frozen: the experiments.
        fit: point at which the residuals are computed.

    """
    sizes: dict[str, float] = {}
    for law, size, deviation in _differences(predictor, frozen, fit):
        if abs(size) > max(NOTICEABLE, SIGNIFICANT * deviation):
            sizes[law] = max(abs(size), sizes.get(law, 0.0))
    return [*map(_usual_words, _usual(fit)), *(_words(law, size) for law, size in sizes.items())]


def _usual(fit: Fit) -> list[tuple[Coordinate, float]]:
    """Return the usual effects that the machine has, with their coordinates."""
    deviations = np.sqrt(np.diag(fit.covariance()))
    return [(c, at) for c, at, deviation in zip(fit.coordinates, fit.at, deviations, strict=True)
            if is_usual(c) and at > SIGNIFICANT * deviation]  # fmt: skip


def _usual_words(found: tuple[Coordinate, float]) -> str:
    c, at = found
    law = next(u.law for u in USUAL if u.name == c.name)
    value, usual = (show(float(f"{c.value(x):.3g}"), c.unit, c.shown) for x in (at, 1.0))
    return (
        f"{law}: this law has another form here than in the configuration, {c.name} = {value}; "
        f"{usual} is usual, and the difference is taken into account"
    )


def _differences(
    predictor: Predictor, frozen: Sequence[object], fit: Fit
) -> list[tuple[str, float, float]]:
    """Return the law, size and uncertainty of each difference, of all experiments together."""
    laws: tuple[str, ...] = ()
    power, product = np.zeros((0, 0)), np.zeros(0)
    for one in (f for f in frozen if isinstance(f, Frozen) and f.forms is not None):
        assert one.forms is not None
        columns, laws = one.forms.columns, one.forms.laws
        residual = _residual(predictor, one, fit)
        whole = columns @ columns.T
        power = whole if not power.size else power + whole
        product = columns @ residual if not product.size else product + columns @ residual
    covariance = np.linalg.inv(np.eye(len(laws)) + power) if laws else power
    # a difference that the model lacks leaves its negative in the residual
    sizes, deviations = -covariance @ product, np.sqrt(np.diag(covariance))
    return list(zip(laws, sizes.tolist(), deviations.tolist(), strict=True))


def _residual(predictor: Predictor, frozen: Frozen, fit: Fit) -> Array:
    """Return the residual before the differences are integrated out."""
    point = predictor.model.memory(fit.coordinates, fit.at)
    return tamed(predictor.innovations(frozen, *point)[0])


def _words(law: str, size: float) -> str:
    how = "is taken into account" if size < MOST_FORMS else (
        "is more than published forms differ: check what the machine has there")  # fmt: skip
    return (
        f"{law}: this law has another form here than in the model; the difference is {size:.1f} "
        f"times its usual size and {how}"
    )
