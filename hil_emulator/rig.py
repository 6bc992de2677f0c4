"""One tick of the emulator in a few lines; the only module that knows everybody."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from hil_emulator.config.load import Configuration, NodeSettings
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame
from hil_emulator.model import kernel
from hil_emulator.model.plant import Plant, Sensors
from hil_emulator.record import Recorder


class FrameDoor(Protocol):
    """The bus as the rig sees it."""

    def receive(self) -> list[Frame]:
        """Return what has arrived, never wait."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames, never wait."""
        ...


class Rig:
    """Plant, sensors and nodes on one bus, moved tick by tick.

    Args:
        plant: the actuator.
        sensors: its sensor channels.
        nodes: the CANopen nodes that show it.
        bus: carries the frames.
        tick_ns: period of the loop [ns].
        steps: integration steps per tick.
        recorder: takes a row per tick, where there is one.

    """

    def __init__(
        self,
        plant: Plant,
        sensors: Sensors,
        nodes: Sequence[Node],
        bus: FrameDoor,
        tick_ns: int,
        steps: int,
        recorder: Recorder | None = None,
    ) -> None:
        self.plant = plant
        self.sensors = sensors
        self.nodes = tuple(nodes)
        self.bus = bus
        self.tick_ns = tick_ns
        self.now_ns = 0
        self._steps = steps
        self._recorder = recorder
        self._measured = self._measure()

    def step(self) -> None:
        """Let one tick pass; the order of these lines is the contract."""
        self._receive(self.bus.receive())
        self.plant.step(self._steps)
        self._measured = self._measure()
        self._publish()
        if self._recorder:
            self._recorder.row(self.now_ns, self.plant, self.sensors)
        self.now_ns += self.tick_ns

    def serve(self, frames: Sequence[Frame]) -> None:
        """Let the nodes answer frames at the present moment; the plant stands still."""
        self._receive(frames)
        self._publish()

    def _receive(self, frames: Sequence[Frame]) -> None:
        for node in self.nodes:
            self.plant.command(node.receive(self.now_ns, frames))

    def _measure(self) -> Measured:
        self.sensors.sample(self.plant.signal_vector)
        return Measured(self.sensors.reading.tolist(), self.sensors.overrange.tolist())

    def _publish(self) -> None:
        for node in self.nodes:
            self.bus.send(node.publish(self.now_ns, self._measured))


def commands(settings: NodeSettings) -> Mapping[str, float]:
    """Return what a node commands, with the values that hold without a controller."""
    return {"valve_current": settings.safe_current}


def nodes(config: Configuration, channels: Sequence[str]) -> list[Node]:
    """Make the CANopen nodes of a configuration.

    Raises:
        UserError: if an EDS is missing, wrong, or maps what nothing feeds.

    """
    return [Node(Dictionary.from_eds(s.eds, s.id), channels, commands(s)) for s in config.nodes]


def assemble(
    config: Configuration,
    bus: FrameDoor,
    cache: Path | None = None,
    recorder: Recorder | None = None,
) -> Rig:
    """Make the rig that a configuration describes; compiles the model and runs it once.

    Args:
        config: the rig's description.
        bus: carries its frames.
        cache: folder that keeps the compiled model for the next start.
        recorder: takes a row per tick, where there is one.

    Raises:
        UserError: if a node cannot be made from its EDS.

    """
    compiled = kernel.build(config.effects, cache)
    plant = Plant(compiled, config.plant, config.step)
    random = np.random.default_rng(config.seed)
    sensors = Sensors(compiled, config.sensors, config.tick_ns * 1e-9, random)
    made = nodes(config, sensors.names)
    return Rig(plant, sensors, made, bus, config.tick_ns, config.steps, recorder)
