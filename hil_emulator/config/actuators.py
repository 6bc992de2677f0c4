"""The actuators of a machine, from its files in order."""

from dataclasses import dataclass

from hil_emulator.config.load import Configuration


@dataclass(frozen=True)
class ActuatorSettings:
    """One actuator of a machine.

    Attributes:
        name: in recordings and faults.
        config: its configuration.
        bus: name of its bus.
        supply: name of the shared supply; None for its own.
        carries: name of the actuator whose joint is at the end of the link that it moves; None
            without one.

    """

    name: str
    config: Configuration
    bus: str
    supply: str | None = None
    carries: str | None = None
