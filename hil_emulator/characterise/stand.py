"""The test stand: an emulated actuator, its mounting, and the instruments.

A test uses the actuator's *sensors*. For a laboratory instrument of the documents (a flow meter, a
displacement transducer on the spool) it reads the model's signal instead; each test states which.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hil_emulator.characterise.result import Series
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Plant
from hil_emulator.model.rating import rated_current
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.smoothed import FRICTION_OF_SPOOL

_CLAMPED = {"load_mass": 1e12}  # the largest force moves it by less than 1 um in a minute
SMALL_CHAMBERS = {
    "cylinder_piston_area": 1e-6,
    "cylinder_area_ratio": 1.0,
    "cylinder_dead_volume_a": 1e-6,
    "cylinder_dead_volume_b": 1e-6,
}
"""A cylinder with chambers of 1 ml."""

_METER_CONDUCTANCE = 1e-7  # 0.01 bar at the nominal flow of the reference machine [m³/(s Pa)]
_PIPE_VOLUME = 1e-2  # on each side of that meter [m³]
_REFERENCE_OPENING = 6.68e-8  # its gain times its rated current [m³/(s √Pa)]


@dataclass(frozen=True)
class BenchRecord:
    """Readings and signals by tick.

    Attributes:
        time: end of each tick [s], shape (ticks,).
        readings: readings of the sensors, by channel; shape (ticks,) each.
        signals: true quantities, by name; for laboratory instruments.

    """

    time: Series
    readings: Mapping[str, Series]
    signals: Mapping[str, Series]

    def after(self, time: float) -> "BenchRecord":
        """Return the record from a time [s] on."""
        late = self.time > time
        return BenchRecord(
            self.time[late],
            {name: values[late] for name, values in self.readings.items()},
            {name: values[late] for name, values in self.signals.items()},
        )


class Stand:
    """One actuator under test.

    Args:
        plant: the actuator.
        sensors: its sensors.
        period: time between two changes of the inputs, and between samples [s].

    """

    def __init__(self, plant: Plant, sensors: Sensors, period: float) -> None:
        self.plant = plant
        self.sensors = sensors
        self.period = period
        self._steps = round(period / plant.step_width)

    def tick(self, current: float, force: float = 0.0) -> Series:
        """Hold valve current [A] and external force [N] for one period; return the readings."""
        self.plant.inputs.valve_current = current
        self.plant.inputs.external_force = force
        self.plant.step(self._steps)
        self.sensors.sample(self.plant.signal_vector, self.plant.path)
        return self.sensors.reading

    def drive(self, currents: ArrayLike, forces: ArrayLike = 0.0) -> BenchRecord:
        """Apply one current [A] and external force [N] per tick and record."""
        pairs = np.broadcast_arrays(np.asarray(currents, float), np.asarray(forces, float))
        rows = [self.row(float(u), float(f)) for u, f in zip(*pairs, strict=True)]
        return self.recording(rows)

    def row(self, current: float, force: float = 0.0) -> Series:
        """Simulate one tick; return readings, followed by signals."""
        reading = self.tick(current, force)
        return np.concatenate([reading, self.plant.signal_vector])

    def recording(self, rows: Iterable[Series]) -> BenchRecord:
        """Return rows of readings and signals as a record."""
        table = np.array(list(rows), dtype=np.float64)
        channels = len(self.sensors.names)
        signals = self.plant.kernel.signals.names or ()
        return BenchRecord(
            np.asarray(self.period * np.arange(1, len(table) + 1), dtype=np.float64),
            dict(zip(self.sensors.names, table[:, :channels].T, strict=True)),
            dict(zip(signals, table[:, channels:].T, strict=True)),
        )


@dataclass(frozen=True)
class Bench:
    """An actuator's parameters, and its mountings on a stand.

    Attributes:
        kernel: the compiled model.
        values: parameters by field name, SI; effects without parameters here are off.
        sensors: transducer parameters by channel and field.
        seed: of the sensors' noise.
        step: integration step [s].

    """

    kernel: Kernel
    values: Mapping[str, float]
    sensors: Mapping[str, Mapping[str, float]]
    seed: int = 1
    step: float = 2e-5

    @property
    def null_opening(self) -> float:
        """Opening at null of edges without overlap [A]: underlap plus leaking lands."""
        return self.value("underlap_lap") + self.value("land_leakage_clearance")

    def stand(self, changes: Mapping[str, float], period: float = 1e-3) -> Stand:
        """Return a new stand with some parameters changed."""
        plant = Plant(self.kernel, {**self.values, **changes}, self.step)
        random = np.random.default_rng(self.seed)
        return Stand(plant, Sensors(self.kernel, self.sensors, period, random), period)

    def off(self, *tables: str, keep: Iterable[str] = ()) -> dict[str, float]:
        """Return the changes that switch off every effect of some configuration tables."""
        return {
            effect.field_of(effect.knob): effect.off
            for effect in self.kernel.effects
            if effect.stage.table in tables and effect.name not in keep
        }

    def clamped(self, keep: Iterable[str] = ()) -> dict[str, float]:
        """Return the changes that clamp the rod and switch off cylinder effects except `keep`."""
        return self.off("cylinder", "load", keep=keep) | _CLAMPED

    def blocked(self) -> dict[str, float]:
        """Return the changes that close both ports of the valve, behind 1 ml of drillings each."""
        return self.clamped() | SMALL_CHAMBERS

    def joined(self) -> dict[str, float]:
        """Return the changes that join ports a and b through pipe and flow meter.

        The meter is modelled as leakage past the piston. Large pipes make it slow enough for the
        integration step; between equal edges the pressure is steady from the start.
        """
        size = self.valve_size
        return self.clamped() | {
            "cylinder_area_ratio": 1.0,
            "cylinder_dead_volume_a": size * _PIPE_VOLUME,
            "cylinder_dead_volume_b": size * _PIPE_VOLUME,
            "internal_leakage_conductance": size * _METER_CONDUCTANCE,
        }

    def sealed(self) -> dict[str, float]:
        """Return the changes that remove the leakage of closed lands."""
        return {"land_leakage_clearance": 0.0, "underlap_lap": self.null_opening}

    def smooth(self) -> dict[str, float]:
        """Return the changes that switch off dry friction and hysteresis, for a linear model.

        The spool's threshold is dry friction, too.
        """
        dry = self.off("friction", keep=("viscous_friction",))
        return dry | dict.fromkeys(FRICTION_OF_SPOOL, 0.0)

    @property
    def valve_size(self) -> float:
        """The valve's flow relative to the reference machine's, to two digits."""
        return float(f"{self.value('valve_gain') * self.rated_current / _REFERENCE_OPENING:.2g}")

    def period(self, seconds: float) -> float:
        """Return the whole number of integration steps that is nearest to a time [s]."""
        return max(1, round(seconds / self.step)) * self.step

    @property
    def viscosity(self) -> float:
        """Kinematic viscosity of the oil as configured [m²/s]."""
        return float(Plant(self.kernel, self.values, self.step).signals.viscosity)

    @property
    def relative_viscosity(self) -> float:
        """Viscosity relative to that at 40 °C, for which the machine's parameters hold."""
        return self.viscosity / self.value("oil_kinematic_viscosity")

    def value(self, field: str) -> float:
        """Return a parameter of the model; its off value or default if it is not set."""
        return float(Plant(self.kernel, self.values, self.step).parameters[field])

    @property
    def rated_current(self) -> float:
        """Current that opens the valve fully [A]."""
        return rated_current(self.values)
