"""An FMU in place of the built-in plant, with the same interface to the rig."""

import logging
from collections.abc import Iterable

import numpy as np

from hil_emulator.config.plant import FmuSettings
from hil_emulator.errors import UserError
from hil_emulator.fmi.importing.process import FmuFailedError, FmuProcess
from hil_emulator.fmi.importing.wiring import Wired, wire
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Supply

Lines = np.ndarray[tuple[int, int], np.dtype[np.float64]]

_log = logging.getLogger(__name__)


class FmuSupply(Supply):
    """The memory of one actuator whose signals come from an FMU.

    Signals without a wired variable are zero. Sensors sample their signals once per tick.

    Args:
        kernel: the model, compiled for one actuator; defines the layouts and the sensors.
        step: integration step [s].
        steps: integration steps per tick.
        settings: settings of the FMU.

    Raises:
        UserError: if the FMU cannot be wired or started.

    """

    built_in = False

    def __init__(self, kernel: Kernel, step: float, steps: int, settings: FmuSettings) -> None:
        super().__init__(kernel, step)
        wiring = wire(settings)
        self._name = settings.file.name
        names, signals = kernel.inputs.names or (), kernel.signals.names or ()
        self._given = [names.index(name) for name in wiring.inputs]
        self._shown = [signals.index(name) for name in wiring.outputs]
        self._scale = _lines(wiring.inputs.values())
        self._back = _lines(wiring.outputs.values())
        try:
            self._fmu = FmuProcess(settings.file, wiring, step, steps, settings.timeout)
        except FmuFailedError as error:
            raise UserError(f"{settings.file}: {error}") from None

    def step(self, steps: int) -> bool:
        """Step the FMU over a tick; do nothing if `steps` is 0.

        Returns:
            Whether the FMU succeeded and all its outputs are finite.

        """
        if self.failure:
            return False
        try:
            if steps > 0:
                self._fmu.step(self.inputs[self._given] * self._scale[:, 0] + self._scale[:, 1])
        except FmuFailedError as error:
            return self._fail(str(error))
        values = (self._fmu.outputs - self._back[:, 1]) / self._back[:, 0]
        self.signals[self._shown] = values
        if not np.isfinite(values).all():
            return self._fail("has an output that is no finite number")
        return True

    def close(self) -> None:
        """End the FMU."""
        self._fmu.close()
        self.failure = self.failure or f"{self._name} has been closed"

    def _fail(self, why: str) -> bool:
        self.failure = f"{self._name} {why}"
        _log.error("%s; the nodes report it, and stay on the bus", self.failure)
        return False


def _lines(wired: Iterable[Wired]) -> Lines:
    """Return factor and offset of each variable, shape (variables, 2)."""
    return np.array([(w.factor, w.offset) for w in wired]).reshape(-1, 2)
