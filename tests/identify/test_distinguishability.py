"""Indistinguishable effects, for problems with a known answer."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation.clusters import UNCORRELATED, Clusters
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.levels import DISTINGUISHABLE
from hil_emulator.identify.selection.rivals import rivals_of, separability
from hil_emulator.identify.selection.scan import Score

N = 4000


def coordinate(name: str, scale: float = 1.0) -> Coordinate:
    """Return an effect with a name and a typical size only."""
    return Coordinate(name, name, "", "N", "N", scale, 0.0, "linear", -1e9, 1e9, np.inf, None)


class Problem:
    """Linear effects a, b in noise: y = size a + noise, both fitted one after the other.

    Args:
        angle: between the two effects' sensitivities.
        power: gain in chi-square of the true effect a at size one.
        correlation: of the noise from sample to sample.
        seed: of the noise.

    """

    def __init__(self, angle: float, power: float, correlation: float = 0.0, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        slow = np.sin(2.0 * np.pi * 8.0 * np.arange(N) / N)
        other = np.cos(2.0 * np.pi * 8.0 * np.arange(N) / N)
        a = slow / np.linalg.norm(slow)
        b = np.cos(angle) * a + np.sin(angle) * other / np.linalg.norm(other)
        noise = random.standard_normal(N)
        for k in range(1, N):
            noise[k] = correlation * noise[k - 1] + np.sqrt(1.0 - correlation**2) * noise[k]
        data = np.sqrt(power) * a + noise
        self.trials = [self._trial(n, c, data) for n, c in (("a", a), ("b", b))]
        self.scores = [t.score for t in self.trials]

    def _trial(self, name: str, sensitivity: np.ndarray, data: np.ndarray) -> Trial:
        size = float(sensitivity @ data)
        score = Score(coordinate(name), size**2, size, 1.0, -sensitivity, -sensitivity, np.zeros(0))
        residual, jacobian = data - size * sensitivity, -sensitivity[:, None]
        fit = Fit([score.coordinate], np.array([size]), residual, jacobian, 0.0)
        return Trial(score, fit, Evidence(size**2, size**2, np.nan, 20.0), 1.0)


def test_separability_is_what_a_rival_would_lose() -> None:
    """D is the squared sine of the angle between two sensitivities times the squared size."""
    p = Problem(0.3, 100.0)
    assert separability(*p.scores, size=5.0) == pytest.approx(25.0 * np.sin(0.3) ** 2, rel=1e-3)
    assert separability(p.scores[0], p.scores[0], size=5.0) == pytest.approx(0.0, abs=1e-6)


def test_near_effects_are_a_group_and_far_ones_are_not() -> None:
    """With a gain of 400, an angle of 0.1 loses 4 and an angle of 0.5 loses 92."""
    for angle, group in ((0.1, ["b"]), (0.5, [])):
        p = Problem(angle, 400.0)
        assert rivals_of(p.trials[0], p.scores)[0] == group
        assert rivals_of(p.trials[0], p.scores, p.trials)[0] == group


def test_a_refit_overrules_the_linear_forecast() -> None:
    """The realised loss of a refit, 100 or 1, decides instead of the linear margin."""
    near, far = Problem(0.1, 400.0), Problem(0.5, 400.0)
    deltas = Evidence(near.trials[0].evidence.delta_chi2 - 100.0, 0.0, np.nan, 20.0)
    lost = Trial(near.scores[1], near.trials[1].fit, deltas, 1.0)
    assert rivals_of(near.trials[0], near.scores, [near.trials[0], lost])[0] == []
    level = Evidence(far.trials[0].evidence.delta_chi2 - 1.0, 0.0, np.nan, 20.0)
    kept = Trial(far.scores[1], far.trials[1].fit, level, 1.0)
    assert rivals_of(far.trials[0], far.scores, [far.trials[0], kept])[0] == ["b"]


def test_held_out_data_separate_too() -> None:
    """A rival with equal training gain that loses 50 on held-out data is not a rival."""
    p = Problem(0.05, 400.0)

    def with_held(trial: Trial, held: float) -> Trial:
        e = trial.evidence
        return Trial(trial.score, trial.fit, Evidence(e.delta_chi2, e.wald, held, e.needed), 1.0)

    best, rival = with_held(p.trials[0], 300.0), with_held(p.trials[1], 250.0)
    assert rivals_of(best, p.scores, [best, rival])[0] == []


def test_an_effect_without_gain_is_not_a_rival() -> None:
    """Effects with a negligible gain are distinguishable.

    The derivative of an impact is a spike at large residuals.
    """
    p, spike = Problem(0.5, 400.0), np.eye(1, N)[0]
    named, other = p.trials[0], replace(p.scores[1], statistic=4.0)
    residual = np.where(spike > 0.0, 100.0, named.fit.residual)
    chosen = replace(named.score, column=spike)
    best = replace(named, score=chosen, fit=replace(named.fit, residual=residual))
    assert UNCORRELATED.variance_factor(spike, residual) > 400.0 / DISTINGUISHABLE
    assert rivals_of(best, [chosen, other])[0] == []
    alike = replace(other, statistic=chosen.statistic, column=spike)
    assert rivals_of(best, [chosen, alike])[0] == ["b"]


def test_correlated_noise_widens_a_group() -> None:
    """Correlated noise has fewer independent residuals, so that more effects are rivals."""
    white, slow, hundred = [], [], Clusters(100, np.zeros(0, np.int64))
    for seed in range(30):
        for correlation, factors in ((0.0, white), (0.9, slow)):
            p = Problem(0.3, 400.0, correlation, seed)
            apart = p.trials[1].fit.residual - p.trials[0].fit.residual
            factors.append(hundred.variance_factor(apart, p.trials[0].fit.residual))
    assert np.median(white) < 2.0
    assert np.median(slow) > 2.0 * np.median(white)


def test_the_separating_size_separates() -> None:
    """At the stated size, D of the nearest rival equals the limit."""
    p = Problem(0.2, 200.0)
    _, size = rivals_of(p.trials[0], p.scores, p.trials)
    assert size is not None
    assert separability(*p.scores, size=size) == pytest.approx(DISTINGUISHABLE, rel=1e-3)


def test_no_size_separates_within_the_tolerance_of_a_law() -> None:
    """A margin below 1.5 % of the gain separates no effects of any size."""
    p = Problem(0.1, 40_000.0)
    assert rivals_of(p.trials[0], p.scores, p.trials) == (["b"], None)
