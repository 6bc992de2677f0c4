"""An actuator and its sensors without bus and nodes."""

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.model.layout import Vector
from hil_emulator.model.sampling import Sensors
from hil_emulator.platform.paths import cache_folder
from hil_emulator.signals.columns import columns, fill_row
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import compiled, plants_of
from hil_emulator.simulation.not_finite import NotFiniteError


class StandAlone:
    """A plant with its sensors, simulated tick by tick.

    Args:
        config: of a whole actuator.
        seed: of the sensor noise; by default that of the configuration.

    Attributes:
        plant: the actuator.
        now_ns: time at which the next tick begins [ns].

    """

    def __init__(self, config: Configuration, seed: int | None = None) -> None:
        lean = acting(config)
        self._config = config
        (self.plant,) = plants_of(compiled(lean.effects, cache_folder()), [lean])
        random = np.random.default_rng(config.seed if seed is None else seed)
        self._sensors = Sensors(self.plant.kernel, lean.sensors, config.tick_ns * 1e-9, random)
        self._sensors.sample(self.plant.signal_vector)
        self.now_ns = 0

    def step(self, **inputs: float) -> None:
        """Execute a tick with inputs of the plant, SI; other inputs keep their values.

        Raises:
            NotFiniteError: if a state is not finite.

        """
        self.plant.command(inputs)
        finite = self.plant.step(self._config.steps)
        self._sensors.sample(self.plant.signal_vector, self.plant.path)
        self.now_ns += self._config.tick_ns
        if not finite:
            raise NotFiniteError(self.now_ns - self._config.tick_ns, self.plant.culprit())

    @property
    def readings(self) -> dict[str, float]:
        """The readings of the sensors, SI."""
        return dict(zip(self._sensors.names, self._sensors.reading.tolist(), strict=True))

    def row(self) -> Vector:
        """Return the last tick as a row of a recording: the time at which it began comes first."""
        row = np.empty(len(columns()))
        fill_row(
            row, self.now_ns - self._config.tick_ns, self.plant, self._sensors.reading.tolist()
        )
        return row
