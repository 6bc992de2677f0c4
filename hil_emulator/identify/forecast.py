"""What an experiment that nobody has recorded yet would tell about two explanations.

The machine is simulated in closed loop as one explanation says it is, and seen through the
predictor that would see the real recording. What the other explanation predicts differently, δ, and
what its free parameters can make good of that, J, are the columns of one matrix A per experiment.
The information adds up over experiments, F = Σ AᵀA, priors included; what remains of δ with
everything free projected out is the separability

    D = F_δδ - F_δJ F_JJ⁻¹ F_Jδ,

the expected difference in chi-square after a joint refit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.closed_loop import Machine, World
from hil_emulator.identify.experiment import Array, Experiment
from hil_emulator.identify.fit import Fitter, prior_rows
from hil_emulator.identify.library import Target
from hil_emulator.identify.observer import NULL_DRIFT, Observer
from hil_emulator.identify.twin import Coordinate

REFITS = 4
"""Iterations of a joint refit with the simulated recording."""


@dataclass(frozen=True)
class Explanation:
    """A model that explains the data.

    Attributes:
        name: the effect that it is about.
        coordinates: what is free in it, the effect last.
        at: where the fit to the data ended.
        chi2: of that fit.

    """

    name: str
    coordinates: list[Coordinate]
    at: Array
    chi2: float


class Forecaster:
    """Forecasts experiments from what is known now.

    Args:
        fitter: with the recorded experiments, its gains frozen at the fitted model.
        observer: the fitter's predictor.
        explanations: the ones to tell apart, with the same free parameters but the last.

    """

    def __init__(
        self, fitter: Fitter, observer: Observer, explanations: Sequence[Explanation]
    ) -> None:
        self.explanations = list(explanations)
        self._fitter = fitter
        self._observer = observer
        self._now = {(t.name, r.name): informed(fitter, t, r) + priors(t, r) for t, r in self.pairs}

    @property
    def pairs(self) -> list[tuple[Explanation, Explanation]]:
        """Every explanation as the truth with every other one as its rival."""
        return [(t, r) for t in self.explanations for r in self.explanations if t is not r]

    @property
    def now(self) -> float:
        """Smallest separability with the data that there are."""
        return min(separability(f) for f in self._now.values())

    def separability(self, target: Target, seed: int = 0) -> float:
        """Return the smallest separability with one more experiment; 0 where it cannot be run."""
        return min(self.separability_of(truth, target, seed) for truth in self.explanations)

    def separability_of(self, truth: Explanation, target: Target, seed: int = 0) -> float:
        """Return the same where one explanation is known to be the truth."""
        fitter = self._seen(self.simulated(truth, target, seed), truth)
        found = []
        for rival in (r for r in self.explanations if r is not truth):
            total = self._now[truth.name, rival.name] + informed(fitter, truth, rival)
            found.append(separability(total) if np.isfinite(total).all() else 0.0)
        return min(found)

    def realised(self, target: Target, truth: Explanation, seed: int) -> float:
        """Return the difference in chi-square of the best rival after refits with new data."""
        more = self._seen(self.simulated(truth, target, seed), truth)
        return margin(self._fitter, more, truth, [r for r in self.explanations if r is not truth])

    def simulated(self, truth: Explanation, target: Target, seed: int) -> Experiment:
        """Return a recording of the machine as an explanation says it is."""
        par, chan = self._observer.twin.memory(truth.coordinates, truth.at)
        machine = Machine(
            self._observer.twin, par, chan, self._world(), self._observer.channels,
            self._observer.step(par),
        )  # fmt: skip
        return machine.record(target, seed)

    def _seen(self, experiment: Experiment, truth: Explanation) -> Fitter:
        """Return a recording with its gains, weighed as the recorded data are."""
        return seen(self._fitter, self._observer, experiment, truth)

    def _world(self) -> World:
        """Return the disturbances that the recorded data show."""
        data = self._fitter.experiments
        noise = np.median([self._observer.noise(e) for e in data], axis=0)
        top = max(float(np.max(np.abs(e.current))) for e in data)
        names = self._observer.channels
        ripple = 0.0
        if "supply_pressure" in names:
            spread = [float(np.nanvar(e.readings["supply_pressure"])) for e in data]
            beyond = float(np.median(spread)) - noise[names.index("supply_pressure")] ** 2
            ripple = float(np.sqrt(2.0 * max(beyond, 0.0)))
        return World(NULL_DRIFT * top, ripple=ripple, noise=dict(zip(names, noise, strict=True)))


def seen(now: Fitter, observer: Observer, experiment: Experiment, truth: Explanation) -> Fitter:
    """Return a fitter with one recording, its gains at a truth, its weights those of the rest."""
    fitter = Fitter(observer, [experiment], 1)
    par, chan = observer.twin.memory(truth.coordinates, truth.at)
    frozen = observer.freeze(experiment, par, chan)
    frozen.weights = np.median([f.weights for f in now.frozen], axis=0)
    fitter.frozen = [frozen]
    return fitter


def informed(fitter: Fitter, truth: Explanation, rival: Explanation) -> Array:
    """Return the information AᵀA of some experiments; the first row and column belong to δ."""
    expected = fitter.residual(truth.coordinates, truth.at)
    other = fitter.residual(rival.coordinates, rival.at)
    slope = fitter.jacobian(rival.coordinates, rival.at, other)
    columns = np.column_stack([other - expected, slope])
    return np.asarray(columns.T @ columns)


def priors(truth: Explanation, rival: Explanation) -> Array:
    """Return the information of the ordinary parameters' priors, in the same order."""
    weights = prior_rows(rival.coordinates)
    shift = weights * (rival.at - truth.at)
    columns = np.column_stack([shift, np.diag(weights)])
    return np.asarray(columns.T @ columns)


def separability(information: Array) -> float:
    """Return D, everything but the first row and column projected out."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-30))
    scaled = information * np.outer(scale, scale)
    inner = np.linalg.pinv(scaled[1:, 1:], rcond=1e-9, hermitian=True)
    left = scaled[0, 0] - scaled[0, 1:] @ inner @ scaled[1:, 0]
    return max(0.0, float(left / scale[0] ** 2))


def margin(now: Fitter, more: Fitter, truth: Explanation, rivals: Sequence[Explanation]) -> float:
    """Return by how much the best rival explains less than the truth, everything refitted."""
    both = Fitter(now.predictor, [*now.experiments, *more.experiments], 1)
    both.frozen = [*now.frozen, *more.frozen]
    right = _refitted(both, truth)
    return min(_refitted(both, r) for r in rivals) - right


def _refitted(fitter: Fitter, explanation: Explanation) -> float:
    return fitter.fit(explanation.coordinates, explanation.at, REFITS).chi2
