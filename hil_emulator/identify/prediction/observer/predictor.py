"""What a search needs of whatever predicts: the whole actuator, or the force balance alone."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

from hil_emulator.identify.measured.experiment import Array, Experiment, Single
from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.residuals.correlation import Correlogram, Noise


class Predictor(Protocol):
    """Computes residuals of experiments; `frozen` is what its own `freeze` has returned.

    Which class that is, only the predictor knows, so nothing stands between the two.
    """

    model: PlantModel
    channels: tuple[str, ...]
    measure: str
    """What residuals are counted in."""
    absent: frozenset[str]
    """Signals that the bench does not have."""
    later: frozenset[str]
    """Parameters that act only with an effect that the search may name."""

    @property
    def correlation_time(self) -> float:
        """Least time over which residuals may be correlated [s]."""

    @property
    def balances(self) -> tuple[Balance, ...]:
        """The balances that the channels can show."""

    def cost(self, par: Array) -> float:
        """Return how much longer a prediction takes at these parameters than usually."""

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> object:
        """Prepare an experiment at given parameters."""

    def weigh(self, frozen: Any, par: Array, chan: Array) -> None:
        """Give the residuals a standard deviation of one."""

    def noise_estimate(self, frozen: Any) -> Correlogram | None:
        """Return what an experiment tells of a noise that all share; None if each has its own."""

    def share(self, frozen: Any, noise: Noise) -> None:
        """Weigh residuals by a noise that all share."""

    def innovations(
        self, frozen: Any, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the residuals, shape (samples, channels), and the model's signals."""

    def with_other_sensors(
        self, frozen: Any, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the residuals with each of other sensors, shape (others, samples, channels).

        They may be linearised along those at the point.
        """

    def relax(self, frozen: Any, par: Array, chan: Array) -> None:
        """Let base laws be of another published form along the run at these parameters."""

    def integrated_out(self, frozen: Any, rows: Array) -> Array:
        """Return rows, shape (..., residuals), with such forms integrated out."""

    def log_determinant(self, frozen: Any) -> float:
        """Return the logarithm of the determinant of the innovations' covariance.

        NaN where it does not depend on the parameters at which an experiment is frozen.
        """

    def regressors(self, frozen: Any, path: Array) -> Regressors:
        """Return what a term may depend on."""

    def through(self, frozen: Any, balance: Balance, terms: Array) -> Array | Single:
        """Return the change of the residual that terms make.

        Args:
            frozen: an experiment.
            balance: in which they are.
            terms: along it, shape (samples, terms).

        Returns:
            One row per term, flat, shape (terms, samples * channels).

        """


class ExactForms:
    """What predicts without those base laws whose forms differ."""

    absent: frozenset[str] = frozenset()
    later: frozenset[str] = frozenset()

    def relax(self, frozen: Any, par: Array, chan: Array) -> None:
        """Do nothing."""

    def integrated_out(self, frozen: Any, rows: Array) -> Array:
        """Return the rows."""
        return rows

    def log_determinant(self, frozen: Any) -> float:
        """Return that the covariance does not depend on the parameters."""
        return math.nan
