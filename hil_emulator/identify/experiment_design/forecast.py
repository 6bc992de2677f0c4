"""Forecast of how well an experiment would distinguish two explanations.

The machine is simulated in closed loop according to one explanation, and predicted by the predictor
of real recordings. The columns of a matrix A per experiment are the deviation δ of the other
explanation's prediction, and its derivatives J by free parameters. The information adds up over
experiments, F = Σ AᵀA, priors included. The part of δ that free parameters cannot explain is the
separability

    D = F_δδ - F_δJ F_JJ⁻¹ F_Jδ,

the expected difference in chi-square after a joint refit. Laws are nonlinear: the rival's
parameters are moved to that minimum and δ is computed once more, with the old data represented by
F.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.estimation.fit import prior_rows
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design.closed_loop import Disturbances, SimulatedBench
from hil_emulator.identify.experiment_design.library import Target
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.tuning import NULL_DRIFT
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.rating import largest_current
from hil_emulator.identify.prediction.residuals.noise import noise_levels

COST_CONVERGED = 0.03
"""Relative gain of a step below which parameters are at their minimum (assumed)."""

MOST_STEPS = 5
"""Largest number of parameter steps in a forecast, halved steps included."""


@dataclass(frozen=True)
class Explanation:
    """A model that explains the data.

    Attributes:
        name: its effect.
        coordinates: its free coordinates, the effect's knob last.
        at: the estimate.
        chi2: of the estimate.

    """

    name: str
    coordinates: list[Coordinate]
    at: Array
    chi2: float


class Forecaster:
    """Forecasts experiments from the present fit.

    Args:
        fitter: with the recorded experiments, its gains frozen at the fitted model.
        observer: the fitter's predictor.
        explanations: to be distinguished; only the parameters of their effects differ.

    Attributes:
        fitter: as given.
        explanations: as given.

    """

    def __init__(
        self, fitter: Fitter, observer: Observer, explanations: Sequence[Explanation]
    ) -> None:
        self.explanations = list(explanations)
        self.fitter = fitter
        self._observer = observer
        self._now: dict[tuple[str, str], Array] = {}
        expected = {e.name: fitter.residual(e.coordinates, e.at) for e in self.explanations}
        for rival in self.explanations:
            jacobian = fitter.jacobian(rival.coordinates, rival.at, expected[rival.name])
            for truth in self.explanations:
                columns = np.column_stack([expected[rival.name] - expected[truth.name], jacobian])
                information = columns.T @ columns + priors(truth, rival)
                self._now[truth.name, rival.name] = np.asarray(information)

    @property
    def now(self) -> float:
        """Smallest separability with the present data."""
        return min(separability(f) for (truth, rival), f in self._now.items() if truth != rival)

    def separability(self, target: Target, seed: int = 0) -> float:
        """Return the smallest separability with one more experiment; 0 if it cannot be run."""
        return min(self.separability_of(truth, target, seed) for truth in self.explanations)

    def separability_of(self, truth: Explanation, target: Target, seed: int = 0) -> float:
        """Return the same if one explanation is the truth."""
        fitter = recorded(self._observer, self.simulated(truth, target, seed), truth)
        expected = fitter.residual(truth.coordinates, truth.at)
        rivals = [r for r in self.explanations if r is not truth]
        return min(bent(self._now[truth.name, r.name], fitter, r, expected) for r in rivals)

    def realised(self, target: Target, truth: Explanation, seed: int) -> float:
        """Return the difference in chi-square of the best rival after refits to a new recording.

        The old data are represented by their information around each explanation's fit.
        """
        more = recorded(self._observer, self.simulated(truth, target, seed), truth)
        left = {}
        for e in self.explanations:
            information = self._now[e.name, e.name].copy()
            information[0, :], information[:, 0] = 0.0, 0.0
            left[e.name] = e.chi2 + bent(information, more, e, 0.0)
        right = left.pop(truth.name)
        return min(left.values()) - right

    def simulated(self, truth: Explanation, target: Target, seed: int) -> Experiment:
        """Return a recording of the machine according to an explanation."""
        par, chan = self._observer.model.memory(truth.coordinates, truth.at)
        machine = SimulatedBench(
            self._observer.model, par, chan, self._world(), self._observer.channels,
            self._observer.steps.width(par),
        )  # fmt: skip
        return machine.record(target, seed)

    def _world(self) -> Disturbances:
        """Return the disturbances in the recorded data."""
        data = self.fitter.experiments
        names = self._observer.channels
        noise = np.median([noise_levels(e, names) for e in data], axis=0)
        top = largest_current(self._observer.model.plant_values)
        ripple = 0.0
        if "supply_pressure" in names:
            spread = [float(np.nanvar(e.readings["supply_pressure"])) for e in data]
            beyond = float(np.median(spread)) - noise[names.index("supply_pressure")] ** 2
            ripple = float(np.sqrt(2.0 * max(beyond, 0.0)))
        return Disturbances(
            NULL_DRIFT * top, ripple=ripple, noise=dict(zip(names, noise, strict=True))
        )


def recorded(observer: Observer, experiment: Experiment, truth: Explanation) -> Fitter:
    """Return a fitter with one recording, its gains and weights at the true explanation."""
    fitter = Fitter(observer, [experiment])
    fitter.freeze(truth.coordinates, truth.at)
    return fitter


def priors(truth: Explanation, rival: Explanation) -> Array:
    """Return the information of the priors, in the same order."""
    weights = prior_rows(rival.coordinates)
    true = {c.name: a for c, a in zip(truth.coordinates, truth.at, strict=True)}
    shift = rival.at - np.array([true.get(c.name, 0.0) for c in rival.coordinates])
    columns = np.column_stack([weights * shift, np.diag(weights)])
    return np.asarray(columns.T @ columns)


def separability(information: Array) -> float:
    """Return D, everything but the first row and column projected out."""
    left = information[0, 0] - information[0, 1:] @ _solved(information[1:, 1:], information[1:, 0])
    return max(0.0, float(left))


def bent(now: Array, fitter: Fitter, explanation: Explanation, aim: Array | float) -> float:
    """Return the misfit of an explanation to old and new data, its parameters at the minimum.

    Args:
        now: information of the old data; the first row and column belong to the misfit there.
        fitter: with the new data.
        explanation: whose parameters move.
        aim: residual of the new data of a perfect model.

    """
    low, high = np.array([c.bounds for c in explanation.coordinates]).T
    best = math.inf
    kept = moved = np.zeros(len(explanation.at))
    for _ in range(MOST_STEPS):
        at = explanation.at + moved
        residual = fitter.residual(explanation.coordinates, at)
        left = residual - aim
        cost = _old(now, moved) + float(left @ left)
        if not cost < best:
            moved = 0.5 * (moved + kept)
            continue
        gained, best, kept = best - cost, cost, moved
        if gained < COST_CONVERGED * cost:
            break
        jacobian = fitter.jacobian(explanation.coordinates, at, residual)
        gradient = now[1:, 0] + now[1:, 1:] @ kept + jacobian.T @ left
        step = _solved(now[1:, 1:] + jacobian.T @ jacobian, gradient)
        moved = np.clip(at - step, low, high) - explanation.at
    return best if math.isfinite(best) else 0.0


def _old(now: Array, shift: Array) -> float:
    """Return the increase of the old data's chi-square by a shift of parameters."""
    return float(now[0, 0] + 2.0 * now[0, 1:] @ shift + shift @ now[1:, 1:] @ shift)


def _solved(matrix: Array, right: Array) -> Array:
    """Solve a positive semidefinite system whose unknowns have very different sizes."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    inverse = np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-9, hermitian=True)
    return np.asarray(scale * (inverse @ (scale * right)))
