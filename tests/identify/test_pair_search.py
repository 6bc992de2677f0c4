"""Pairs of candidates that cancel each other, for problems with a known answer."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.refits import PairSearch
from hil_emulator.identify.selection.scan import Pair, Score, pairs_of, score_of

N = 3000


def coordinate(name: str, most: float = 1e9) -> Coordinate:
    """Return an effect with a name, a typical size and a range only."""
    return Coordinate(name, name, "", "N", "N", 1.0, 0.0, "linear", -most, most, np.inf, None)


def scanned(
    residual: np.ndarray, sensitivities: dict[str, np.ndarray], most: float = 1e9
) -> tuple[list[Score], Fit]:
    """Return linear scores of candidates in a model without parameters, best first."""
    fit = Fit([], np.zeros(0), residual, np.zeros((N, 0)), float(residual @ residual))
    scores = [score_of(coordinate(n, most), t, Projection(fit)) for n, t in sensitivities.items()]
    return sorted(scores, key=lambda s: -s.statistic), fit


def orthogonal(count: int) -> list[np.ndarray]:
    """Return orthogonal sensitivities of squared norm 100."""
    random = np.random.default_rng(3)
    basis = np.linalg.qr(random.standard_normal((N, count)))[0]
    return [10.0 * column for column in basis.T]


def test_two_that_nearly_cancel_are_found_and_a_third_is_not() -> None:
    """Both have size 1 and opposite signs, 90 % in common; a third fits the difference."""
    common, difference, other, noise = orthogonal(4)
    a, b = 0.95 * common + 0.31 * difference, 0.95 * common - 0.31 * difference
    residual = -(a - b)
    third = 0.7 * difference + 0.714 * other
    scores, fit = scanned(residual + 0.01 * noise, {"a": a, "b": b, "third": third})
    assert scores[0].coordinate.name == "third"
    pairs = pairs_of(scores, fit)
    assert {s.coordinate.name for s in pairs[0].scores} == {"a", "b"}
    sizes = {s.coordinate.name: x for s, x in zip(pairs[0].scores, pairs[0].sizes, strict=True)}
    assert sizes["a"] == pytest.approx(1.0, rel=1e-3)
    assert sizes["b"] == pytest.approx(-1.0, rel=1e-3)
    assert pairs[0].delta_chi2 == pytest.approx(float(residual @ residual), rel=1e-3)


def test_orthogonal_effects_need_no_pair() -> None:
    """Two orthogonal effects are selected one after the other."""
    a, b, c = orthogonal(3)
    assert pairs_of(*scanned(-(a + 0.9 * b), {"a": a, "b": b, "c": c})) == []


def test_a_pair_beyond_its_range_is_not_proposed() -> None:
    """Two nearly collinear effects explain anything at unrealistic sizes."""
    common, difference, other = orthogonal(3)
    a, b = 0.97 * common + 0.24 * difference, 0.97 * common - 0.24 * difference
    sensitivities = {"a": a, "b": b, "third": 0.7 * difference + 0.7 * other}
    residual = -5.0 * (a - b)
    assert pairs_of(*scanned(residual, sensitivities))
    assert pairs_of(*scanned(residual, sensitivities, most=3.0)) == []


class Bent:
    """A model whose effects each do more and more, by so much of their square."""

    def __init__(self, fit: Fit, sensitivities: dict[str, np.ndarray], bend: float) -> None:
        self._fit, self._sensitivities, self._bend = fit, sensitivities, bend
        self.asked: list[float] = []

    def within(
        self, coordinates: Sequence[Coordinate], points: Sequence[np.ndarray], most: float
    ) -> Iterator[tuple[np.ndarray, float] | None]:
        """Yield the residual at each point and its square; None beyond `most`."""
        for at in points:
            self.asked.append(float(abs(at[0])))
            residual = self._fit.residual.copy()
            for c, size in zip(coordinates, at, strict=True):
                residual += size * (1.0 + self._bend * abs(size)) * self._sensitivities[c.name]
            square = float(residual @ residual)
            yield (residual, square) if square <= most else None


@pytest.mark.parametrize(("bend", "parts"), [(0.0, [1.0]), (0.9, [1.0, 0.5])])
def test_half_of_a_step_is_tried_if_the_whole_is_too_long(bend: float, parts: list[float]) -> None:
    """A linear model needs one trial, a strongly nonlinear one a second with half the step."""
    a, b = orthogonal(2)
    sensitivities = {"a": a, "b": b}
    scores, fit = scanned(-(a + b), sensitivities)
    model: Any = Bent(fit, sensitivities, bend)
    pair = Pair((scores[0], scores[1]), (1.0, 1.0), fit.chi2)
    with pytest.raises(AttributeError):  # it goes on to refit both, which this model cannot
        PairSearch(model, fit, None, 20.0).first_of_pair([pair], 0.0)
    assert model.asked == parts
