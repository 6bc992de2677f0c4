"""The whole rig with nodes and bus, and a controller in its loop."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Self

from hil_emulator.api.actuator import ActuatorModel, Quantity, load
from hil_emulator.api.tables import recorded
from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import on_bus
from hil_emulator.device.nmt import BROADCAST, NMT_COB_ID, Command
from hil_emulator.frame import Frame
from hil_emulator.signals.inputs import setting
from hil_emulator.simulation.emulator import Emulator, Signals

if TYPE_CHECKING:
    import pandas

_CURRENT = "valve_current"


class LockstepRig(Emulator):
    """An actuator with its CANopen nodes, in lock-step with the caller of `step`.

    The first tick, in which the nodes boot, has passed; in the next one they are OPERATIONAL. CAN
    controllers of this process join with `can.Bus(**rig.bus)`.

    Args:
        machine: the actuator, or its name or file.
        seed: of the sensor noise; by default that of the configuration.

    Raises:
        UserError: if it has no nodes, or for errors in its files.

    """

    def __init__(self, machine: ActuatorModel | str | Path, seed: int | None = None) -> None:
        actuator = machine if isinstance(machine, ActuatorModel) else load(machine)
        config = on_bus(actuator.config)
        super().__init__(config if seed is None else dataclasses.replace(config, seed=seed))
        self.name = actuator.name
        self.tick()
        with Bus(self.bus) as master:
            master.send([Frame(NMT_COB_ID, bytes([Command.START, BROADCAST]))])

    def step(self, current: Quantity | None = None) -> Signals:
        """Execute one tick and return the signals after it.

        Args:
            current: the set point of the valve current, SI or with its unit; None keeps the one
                before, or that of CAN.

        Raises:
            UserError: for a current that the node refuses.

        """
        if current is not None:
            value = setting(_CURRENT, current) if isinstance(current, str) else float(current)
            self.rig.set(_CURRENT, value)  # before the tick in which the nodes apply it
        self.tick()
        return self.signals

    def table(self) -> "pandas.DataFrame":
        """Return the recording since the start, as `ActuatorModel.simulate` does."""
        return recorded(self.recorder.rows(), machine=self.name, digest=self.config.digest)

    def __enter__(self) -> Self:
        return self
