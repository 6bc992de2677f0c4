"""The actuators of a machine, as one file after the other has described them."""

from dataclasses import dataclass

from hil_emulator.config.load import Configuration


@dataclass(frozen=True)
class ActuatorSettings:
    """One actuator of a machine.

    Attributes:
        name: what recordings and faults call it.
        config: its configuration.
        bus: name of its bus.
        supply: name of the supply that it shares; None for one of its own.
        carries: name of the actuator whose joint is at the end of the link that it moves; None
            where its load stands for itself.

    """

    name: str
    config: Configuration
    bus: str
    supply: str | None = None
    carries: str | None = None
