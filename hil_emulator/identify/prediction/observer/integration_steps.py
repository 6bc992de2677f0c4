"""How far the integrator steps in a prediction: as far as it follows the machine."""

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.plant_model import PlantModel

LARGEST_STEP = 5e-4
"""Integration step of a prediction [s]; half of it moves no estimate by more than a seventh of the
interval that a minute of data leaves."""

CAREFUL_STEP = 2.5e-4
"""The same where something is too fast for that [s]: a third of a millisecond loses a sixth of the
width of a loop, whose flux follows the current within a fifth of one."""

FOLLOWED = 1.0
"""Step times largest eigenvalue of the configured machine up to which classical Runge-Kutta follows
its fastest mode: to 1 % of amplitude and phase in a step."""

SMALLEST_STEP = 1e-5
"""Integration step below which no effect is followed [s]."""

STABLE = 2.0
"""Step times largest eigenvalue: classical Runge-Kutta is stable up to 2.785."""


class IntegrationSteps:
    """The integration steps of one model.

    Args:
        model: the model.
        largest: largest step [s]; a machine too fast for it gets a careful one.

    Attributes:
        largest: largest step that the configured machine gets [s].

    """

    def __init__(self, model: PlantModel, largest: float = LARGEST_STEP) -> None:
        self._model = model
        followed = FOLLOWED / max(model.fastest(model.par), 1.0)
        self.largest = largest if largest <= max(CAREFUL_STEP, followed) else CAREFUL_STEP
        self._last = (b"", self.largest)

    def width(self, par: Array) -> float:
        """Return a step that follows these parameters [s]."""
        key, last = par.tobytes(), self._last
        if key != last[0]:
            fastest = max(self._model.fastest(par), 1.0)
            stable = max(SMALLEST_STEP, STABLE / fastest)
            usual = stable >= self.largest
            last = key, self.largest if usual else min(CAREFUL_STEP, stable)
            # as a whole: other threads predict as well
            self._last = last
        return last[1]
