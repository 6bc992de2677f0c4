"""One tick of the emulator in a few lines; the only module that imports plant, device and bus."""

import logging
import math
from collections.abc import Callable, Sequence
from typing import Any

from hil_emulator.can_timing.wire import WINDOW_NS, TimedWire
from hil_emulator.device.emergency import ErrorBit, ErrorCode
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.faults.active import Faults
from hil_emulator.faults.fault import Fault, fault
from hil_emulator.faults.frames import BusFaultKind
from hil_emulator.faults.plant import SUPPLY
from hil_emulator.faults.possible import ensure_possible
from hil_emulator.faults.running import Running
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.partners.partner import Partner
from hil_emulator.recording.memory import Recorder
from hil_emulator.signals.columns import MODEL
from hil_emulator.signals.inputs import OF_SUPPLY, checked
from hil_emulator.simulation.fast_path_nodes import FastPathNodes
from hil_emulator.simulation.frame_router import FrameRouter, Participant
from hil_emulator.simulation.not_finite import NotFiniteError
from hil_emulator.simulation.settings import Settings
from hil_emulator.simulation.timed_can_port import CanPort, TimedCanPort, TimedRouter

NS_PER_US = 1_000

_log = logging.getLogger(__name__)


class Rig:
    """Plant, sensors and nodes on one bus, simulated tick by tick.

    Args:
        plant: the actuator.
        sensors: its sensor channels.
        nodes: the CANopen nodes of the actuator, and partners.
        bus: carries the frames.
        tick_ns: period of the loop [ns].
        steps: integration steps per tick.
        recorder: records every tick; None for no recording.
        not_finite: reaction to a state that is not finite: "stop" or "reset".

    Attributes:
        now_ns: emulator time at which the next tick begins [ns].
        faults: the faults.
        slipped_ns: total delay of its time behind real time.
        measured: the last sample, if it has been read, see `sample`.
        left_stroke_ns: when the rod of a cylinder without ends left its stroke; None if it did not.
        wire: model of the bus timing, if the bus has one.
        supply_mates: the other rigs on its supply, which share its faults.

    """

    def __init__(
        self,
        plant: Plant,
        sensors: Sensors,
        nodes: Sequence[Participant],
        bus: CanPort,
        tick_ns: int,
        steps: int,
        recorder: Recorder | None = None,
        not_finite: str = "stop",
    ) -> None:
        self.plant = plant
        self.sensors = sensors
        self.nodes = tuple(node for node in nodes if isinstance(node, Node))
        self.partners = tuple(node for node in nodes if isinstance(node, Partner))
        self._everyone: tuple[Participant, ...] = (*self.nodes, *self.partners)
        self.bus = bus
        self.tick_ns = tick_ns
        self.now_ns = 0
        self.slipped_ns = 0
        self.left_stroke_ns: int | None = None
        self._watched = not plant.has_ends
        self.recorder = recorder
        self.faults = Faults(plant, sensors, self.nodes, self.value, self._began, self._ended)
        self._settings = Settings(plant, self.nodes, self.faults.parameters)
        self._steps = steps
        self._resets = not_finite == "reset"
        self.wire: TimedWire | None = None
        self.supply_mates: Sequence[Rig] = ()
        self._router = FrameRouter(self._everyone)
        if isinstance(bus, TimedCanPort):
            self.wire = bus.wire
            self._router = TimedRouter(self._everyone, bus)
            self._router.disturb(self.faults.destroys, self.faults.acknowledged)
        self._only = self.nodes[0] if len(self._everyone) == 1 and not self.wire else None
        self.measured: Measured | None = None
        self._fast_path = FastPathNodes(self, steps)
        self._measure()

    def step(self) -> None:
        """Execute one tick; the order of these lines is the contract.

        Rigs on one supply execute each line together, see `machine.Machine.step`.

        Raises:
            NotFiniteError: if a state is not finite, after bus and recording have been informed.

        """
        if self._fast_path.tick():
            return
        self.receive()
        finite = self.integrate()
        self.publish(finite)

    def receive(self) -> None:
        """Begin a tick: faults begin and end, frames are received."""
        if self.faults.active:
            self._fast_path.leave()
            self.faults.schedule(self.now_ns)
        if self.wire:
            self._router.begin(self.now_ns)
        self._deliver(self.bus.receive())

    def integrate(self) -> bool:
        """Integrate all plants on the supply by one tick; return whether every state is finite."""
        return self.plant.step(self._steps)

    def publish(self, finite: bool) -> None:
        """End a tick: the sensors sample, the nodes publish, the recorder takes the row.

        Args:
            finite: whether every state of all plants on the supply is finite.

        Raises:
            NotFiniteError: see `step`.

        """
        if finite:
            self._measure()
        else:
            self._fail()
        self.conclude(finite)

    def conclude(self, finite: bool) -> None:
        """End a tick in which the sensors have sampled: see `publish`."""
        if self.sensors.ranges:
            self._fast_path.leave(renewed=True)
        self._transmit()
        if self.recorder:
            measured = self.measured.values if self.measured else self.sensors.reading
            self.recorder.row(self.now_ns, self.plant, measured)
            if self.wire and self.now_ns % WINDOW_NS < self.tick_ns <= self.now_ns:
                self.recorder.event(self.now_ns, {"bus_load": self.wire.load})
        self.now_ns += self.tick_ns
        if self._watched and self.plant.beyond_stroke:
            self.left_stroke_ns, self._watched = self.now_ns, False
        if not finite:
            self._recover()

    def serve(self, frames: Sequence[Frame]) -> None:
        """Make the nodes answer frames at the present time, without a step of the plant."""
        if self.recorder:
            self.recorder.event(self.now_ns, {"serve": len(frames)})
        self._fast_path.leave()
        self._router.stand()
        self._deliver(frames)
        self._transmit()
        self._router.go_on()

    def slip(self, total_ns: int) -> None:
        """Store the total delay of emulator time behind real time."""
        if self.recorder and total_ns > self.slipped_ns:
            self.recorder.event(self.now_ns, {"slipped": total_ns})
        self.slipped_ns = total_ns

    def fault(self, target: str, kind: str, /, **options: Any) -> Running:
        """Inject a fault; the result ends it, by `end()` or as a `with` block.

        See `hil_emulator.faults.fault.fault` for the arguments.

        Raises:
            UserError: for an unknown target, kind or option.

        """
        return self.inject(fault(target, kind, **options))

    def inject(self, chosen: Fault) -> Running:
        """Inject a fault.

        Raises:
            UserError: for a target that the rig lacks.

        """
        ensure_possible(chosen, self.faults, self.nodes, takes_time=self.wire is not None)
        mates = self.supply_mates if chosen.target == SUPPLY else ()
        running, *others = [rig._schedule_fault(chosen, self.value) for rig in (self, *mates)]
        running.others = others
        return running

    def set(self, name: str, value: float) -> str:
        """Set a condition of the surroundings or a set point, SI: see `signals.inputs`.

        Returns:
            The reason why a set point is not yet in force; "" if it is.

        Raises:
            UserError: lists the settings, or names the bound or limit that is exceeded.

        """
        value = checked(name, value)
        for rig in (self, *(self.supply_mates if name in OF_SUPPLY else ())):
            rig._settings.put(name, value)
            if rig.recorder:
                rig.recorder.event(rig.now_ns, {"set": {name: value}})
        return self._settings.waits(name)

    def value(self, name: str) -> float:
        """Return the present value of a recorded signal, SI; see `record.columns`.

        Raises:
            ValueError: for a name that is not a column of a recording.

        """
        if name == "time":
            return self.now_ns * 1e-9
        if name in self.sensors.names:
            return self.sample().values[self.sensors.names.index(name)]
        if name.startswith(MODEL):
            return float(self.plant.signals[name.removeprefix(MODEL)])
        return float(self.plant.inputs[name])

    def _schedule_fault(self, chosen: Fault, value: Callable[[str], float]) -> Running:
        """Schedule a fault whose condition uses the signals of `value`."""
        running = self.faults.inject(chosen, self.now_ns, value)
        if self.recorder:
            what = {"target": chosen.target, "kind": chosen.kind.name, **chosen.arguments}
            self.recorder.event(self.now_ns, {"fault": what})
        return running

    def _began(self, running: Running) -> None:
        kind = running.fault.kind
        if isinstance(kind, BusFaultKind) and kind.error_classes:
            self.bus.report(kind.error_classes[0])

    def _ended(self, running: Running) -> None:
        kind = running.fault.kind
        began = running.began_ns is not None
        if began and isinstance(kind, BusFaultKind) and kind.error_classes:
            self.bus.report(kind.error_classes[1])
        if self.recorder:
            self.recorder.event(self.now_ns, {"end": running.number})

    def _deliver(self, frames: Sequence[Frame]) -> None:
        if self.recorder and frames:
            self.recorder.bus(self.now_ns, frames, sent=False)
        if self.faults.active:
            self._deliver_faulty(frames)
            return
        if self._only:
            commands = self._only.receive(self.now_ns, frames)
            if commands:
                self.plant.command(commands)
            return
        for node, arriving in self._router.arriving(frames, everything=False):
            commands = node.receive(self.now_ns, arriving)
            if commands:
                self.plant.command(commands)

    def _deliver_faulty(self, frames: Sequence[Frame]) -> None:
        """Pass frames to the nodes, except those that faults suppress."""
        for node, arriving in self._router.arriving(frames, everything=True):
            reached = self.faults.arriving(self.now_ns, node, arriving)
            commands = node.receive(self.now_ns, reached)
            if commands:
                self.plant.command(commands)
        self.faults.act_on(self.now_ns, self.plant)

    def _measure(self) -> None:
        self.sensors.sample(self.plant.signal_vector, self.plant.path, self.now_ns // NS_PER_US)
        self.measured = None
        if self.faults.active:
            self.measured = self.faults.sensed(self.now_ns, self.sample())

    def sample(self) -> Measured:
        """Return the last sample."""
        if self.measured is None:
            reading, overrange = self.sensors.reading, self.sensors.overrange
            self.measured = Measured(reading.tolist(), overrange.tolist())
        return self.measured

    def _fail(self) -> None:
        """Make the nodes report that their measurement has failed; there are no readings."""
        for node in self.nodes:
            node.raise_error(NotFiniteError, ErrorCode.INTERNAL_SOFTWARE, ErrorBit.GENERIC)
        count = len(self.sensors.names)
        self.measured = Measured([math.nan] * count, [0] * count)

    def _recover(self) -> None:
        """End the run, or restart the model at rest; a failed FMU does neither."""
        if self.plant.supply.failure:  # reported by the nodes, which stay on the bus
            return
        error = NotFiniteError(self.now_ns - self.tick_ns, self.plant.culprit())
        if not self._resets:
            raise error
        _log.warning("%s; the model restarts at rest", error)
        self.plant.restart()
        self.sensors.restart()
        for node in self.nodes:
            node.clear_error(NotFiniteError)

    def _transmit(self) -> None:
        outgoing: Sequence[Frame] = ()
        on_fast_path = True
        for node in self._everyone:
            if isinstance(node, Node) and node.fast_path.until_ns:
                sent: Sequence[Frame] = node.repeat(self.now_ns, self.sensors.record)
            else:
                sent = node.publish(self.now_ns, self.sample())
                on_fast_path = False
                if self.faults.active:
                    sent = self.faults.leaving(self.now_ns, node, sent)
            self._router.publish(node, sent)
            outgoing = [*outgoing, *sent] if outgoing else sent
        if not on_fast_path:
            self._fast_path.enter()
        for time_ns, frames in self._router.leaving(self.now_ns, outgoing):
            self._send(time_ns, frames)

    def _send(self, time_ns: int, frames: Sequence[Frame]) -> None:
        self.bus.send(frames)
        if self.recorder:
            self.recorder.bus(time_ns, frames, sent=True)
