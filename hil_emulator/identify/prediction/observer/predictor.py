"""Interface of predictors: of the complete actuator, and of benches with a part of it."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

from hil_emulator.identify.measured.experiment import Array, Experiment, Single
from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.residuals.correlation import Correlogram, Noise


class Predictor(Protocol):
    """Computes residuals of experiments.

    The arguments `frozen` are results of the predictor's own `freeze`.
    """

    model: PlantModel
    channels: tuple[str, ...]
    measure: str
    """Unit of the residuals."""
    absent: frozenset[str]
    """Signals that the bench does not have."""
    later: frozenset[str]
    """Parameters that act only with an effect that the search may name."""

    @property
    def correlation_time(self) -> float:
        """Smallest correlation time of residuals [s]."""

    @property
    def balances(self) -> tuple[Balance, ...]:
        """Balances whose terms change the channels."""

    def cost(self, par: Array) -> float:
        """Return the computing time at these parameters over the usual time."""

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> object:
        """Prepare an experiment at given parameters."""

    def weigh(self, frozen: Any, par: Array, chan: Array) -> None:
        """Set the weights for residuals of unit variance."""

    def noise_estimate(self, frozen: Any) -> Correlogram | None:
        """Return an experiment's contribution to a common noise; None if each has its own."""

    def share(self, frozen: Any, noise: Noise) -> None:
        """Set the weights for a common noise."""

    def innovations(
        self, frozen: Any, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the residuals, shape (samples, channels), and the model's signals."""

    def with_other_sensors(
        self, frozen: Any, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the residuals with each of other sensors, shape (others, samples, channels).

        They may be linearised along the run at the point.
        """

    def log_determinant(self, frozen: Any) -> float:
        """Return the logarithm of the determinant of the innovations' covariance.

        NaN if it does not depend on the parameters at which an experiment is frozen.
        """

    def regressors(self, frozen: Any, path: Array) -> Regressors:
        """Return the regressors of free terms."""

    def through(self, frozen: Any, balance: Balance, terms: Array) -> Array | Single:
        """Return the change of the residual by terms.

        Args:
            frozen: of one experiment.
            balance: of the terms.
            terms: along the trajectory, shape (samples, terms).

        Returns:
            One row per term, flat, shape (terms, samples * channels).

        """


class FixedCovariance:
    """Base of predictors whose innovations have a covariance that no parameter changes."""

    absent: frozenset[str] = frozenset()
    later: frozenset[str] = frozenset()

    def log_determinant(self, frozen: Any) -> float:
        """Return NaN: the covariance does not depend on the parameters."""
        return math.nan
