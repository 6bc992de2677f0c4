"""Integration step of a prediction, by the fastest dynamics of the model."""

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.plant_model import PlantModel

LARGEST_STEP = 5e-4
"""Integration step of a prediction [s]; halving it changes no estimate by more than 1/7 of the
interval from a minute of data."""

CAREFUL_STEP = 2.5e-4
"""Step for faster dynamics [s]: with 0.33 ms a hysteresis loop with a time constant of 0.2 ms loses
1/6 of its width."""

FOLLOWED = 1.0
"""Step times largest eigenvalue of the configured machine up to which classical Runge-Kutta is
accurate to 1 % of amplitude and phase per step."""

SMALLEST_STEP = 1e-5
"""Smallest integration step [s]."""

STABLE = 2.0
"""Step times largest eigenvalue: classical Runge-Kutta is stable up to 2.785."""


class IntegrationSteps:
    """The integration steps of one model.

    Args:
        model: of the actuator.
        largest: largest step [s]; `CAREFUL_STEP` for a machine with faster dynamics.

    Attributes:
        largest: largest step for the configured machine [s].

    """

    def __init__(self, model: PlantModel, largest: float = LARGEST_STEP) -> None:
        self._model = model
        followed = FOLLOWED / max(model.fastest(model.par), 1.0)
        self.largest = largest if largest <= max(CAREFUL_STEP, followed) else CAREFUL_STEP
        self._last = (b"", self.largest)

    def width(self, par: Array) -> float:
        """Return a stable step for these parameters [s]."""
        key, last = par.tobytes(), self._last
        if key != last[0]:
            fastest = max(self._model.fastest(par), 1.0)
            stable = max(SMALLEST_STEP, STABLE / fastest)
            usual = stable >= self.largest
            last = key, self.largest if usual else min(CAREFUL_STEP, stable)
            # replaced by a single assignment, since other threads use it too
            self._last = last
        return last[1]
