"""The faults of a running rig: begin, end and effect of each."""

import math
from collections.abc import Callable, Sequence

from hil_emulator.device.distortion import Distortion
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.faults.coil import CoilFaultKind
from hil_emulator.faults.connection import connection
from hil_emulator.faults.fault import Fault
from hil_emulator.faults.frame_filters import FrameFault
from hil_emulator.faults.frames import BusFaultKind
from hil_emulator.faults.objects import ObjectFaultKind, Wrong, place
from hil_emulator.faults.plant import PlantFaultKind
from hil_emulator.faults.plant_parameters import PlantParameters
from hil_emulator.faults.running import Running
from hil_emulator.faults.sensor import Act, Place, SensorFaultKind
from hil_emulator.faults.strength import Change
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.sensors import CHANNELS

MOST = 64
"""Largest number of faults at a time (assumed)."""

MOST_FRAMES = 1000
"""Largest number of frames per tick after faults; a bus carries about 20 per ms (assumed)."""


class Faults:
    """All faults of a rig.

    The rig calls it at four points of a tick; without faults each call is one comparison.

    Args:
        plant: its parameters and its coil current can be faulty.
        sensors: their readings can be faulty.
        nodes: their connections and objects can be faulty.
        value: returns the present value of a signal, for conditions.
        on_begin: called with each fault that begins.
        on_end: called with each fault that has ended.

    """

    def __init__(
        self,
        plant_: Plant,
        sensors: Sensors,
        nodes: Sequence[Node],
        value: Callable[[str], float],
        on_begin: Callable[[Running], None],
        on_end: Callable[[Running], None],
    ) -> None:
        self._on_begin = on_begin
        self._on_end = on_end
        self._count = 0
        self._nodes = tuple(nodes)
        self._value = value
        self._channels = sensors.names
        self._upper = _upper_ends(plant_, sensors)
        self.parameters = PlantParameters(plant_)
        self._waiting: list[Running] = []
        self._running: list[Running] = []
        self._changes: list[tuple[Running, str, Change]] = []
        self._coil: list[tuple[Running, Change]] = []
        self._samples: list[tuple[Running, Act]] = []
        self._objects: list[tuple[Running, Node, Distortion]] = []
        self._frames: list[tuple[Running, Node, FrameFault]] = []
        self._freed: list[tuple[Node, list[Frame], list[Frame]]] = []
        self.active = False

    @property
    def injected(self) -> list[Running]:
        """Return the faults that have not ended."""
        return [*self._waiting, *self._running]

    def inject(
        self, fault: Fault, now_ns: int, value: Callable[[str], float] | None = None
    ) -> Running:
        """Schedule a fault for the next tick, or for its start and condition.

        Args:
            fault: to inject.
            now_ns: present time [ns].
            value: returns the signals of its condition; by default those of this rig.

        Raises:
            UserError: if there are `MOST` already, because each takes time in every tick.

        """
        if len(self.injected) >= MOST:
            raise UserError(f"{MOST} faults are injected already; end some of them")
        running = Running(fault, self._count, now_ns, value or self._value, self._end)
        self._count += 1
        self._waiting.append(running)
        self.active = True
        return running

    def schedule(self, now_ns: int) -> None:
        """Begin and end the faults that are due at this tick."""
        if not self.active:
            return
        for running in list(self._waiting):
            condition = running.fault.condition
            if now_ns >= running.earliest_ns and (
                condition is None or condition.holds(running.value)
            ):
                self._begin(running, now_ns)
        for running in list(self._running):
            duration = running.fault.duration_ns
            assert running.began_ns is not None
            if duration is not None and now_ns >= running.began_ns + duration:
                running.end()

    def act_on(self, now_ns: int, plant_: Plant) -> None:
        """Change the plant's parameters and its coil current."""
        if not self.active:
            return
        changed: dict[str, float] = {}
        for running, name, change in self._changes:
            value = changed.get(name, self.parameters.sound(name))
            changed[name] = change(value, running.strength(now_ns).drawn())
        self.parameters.change(changed)
        for running, change in self._coil:
            share = running.strength(now_ns).drawn()
            plant_.inputs.valve_current = change(float(plant_.inputs.valve_current), share)

    def sensed(self, now_ns: int, measured: Measured) -> Measured:
        """Return the readings with the sensors' faults."""
        if not self._samples:
            return measured
        values, ranges = list(measured.values), list(measured.overrange)
        for running, act in self._samples:
            act(running.strength(now_ns), values, ranges)
        return Measured(values, ranges)

    def arriving(self, now_ns: int, node: object, given: Sequence[Frame]) -> Sequence[Frame]:
        """Return the frames that reach a node."""
        if not self.active:
            return given
        passed = [f for owner, inward, _ in self._freed if owner is node for f in inward]
        passed += given
        for running, owner, act in self._frames:
            if owner is node:
                passed = act.arriving(running.strength(now_ns), passed)[:MOST_FRAMES]
        return passed

    def leaving(self, now_ns: int, node: object, given: Sequence[Frame]) -> Sequence[Frame]:
        """Return the frames of a node that reach the bus."""
        if not self.active:
            return given
        passed = [f for owner, _, outward in self._freed if owner is node for f in outward]
        self._freed = [item for item in self._freed if item[0] is not node]
        passed += given
        for running, owner, act in self._frames:
            if owner is node:
                passed = act.leaving(running.strength(now_ns), passed)[:MOST_FRAMES]
        self.active = bool(self._waiting or self._running or self._freed)
        return passed

    def destroys(self, node: object, now_ns: int) -> bool:
        """Return whether an error frame destroys the frame that a node begins to send."""
        return any(
            act.destroys(running.strength(now_ns))
            for running, owner, act in self._frames
            if owner is node
        )

    def acknowledged(self, node: object, now_ns: int) -> bool:
        """Return whether another node acknowledges the frame that a node sends."""
        return all(
            act.acknowledged(running.strength(now_ns))
            for running, owner, act in self._frames
            if owner is node
        )

    def _begin(self, running: Running, now_ns: int) -> None:
        self._waiting.remove(running)
        self._running.append(running)
        running.began_ns = now_ns
        self._apply(running)
        self._on_begin(running)
        if emergency := running.fault.kind.emergency:
            for node in self._nodes:
                node.raise_error(running, *emergency)

    def _apply(self, running: Running) -> None:
        """Begin the effect of a fault in its layer."""
        fault, kind = running.fault, running.fault.kind
        if isinstance(kind, PlantFaultKind):
            self._changes.append((running, kind.parameter, kind.begin(**fault.values)))
        elif isinstance(kind, CoilFaultKind):
            self._coil.append((running, kind.begin(**fault.values)))
        elif isinstance(kind, SensorFaultKind):
            at, upper = self._channels.index(fault.target), self._upper[fault.target]
            place = Place(at, upper, self._channels, self._unpowered(fault.target))
            self._samples.append((running, kind.begin(place, **fault.values)))
        elif isinstance(kind, ObjectFaultKind):
            for node, entry in self.targeted(fault):
                distortion = Distortion(entry, _distorting(running, kind.begin(**fault.values)))
                node.distortions.append(distortion)
                self._objects.append((running, node, distortion))
        elif isinstance(kind, BusFaultKind):
            nodes = [n for n in self._nodes if fault.node in (None, n.node_id)]
            for node in nodes[:1] if kind.once else nodes:
                act = kind.begin(connection(node, fault.thing), **fault.values)
                self._frames.append((running, node, act))

    def targeted(self, fault: Fault) -> list[tuple[Node, Entry]]:
        """Return the objects, with their nodes, that a fault targets."""
        at = place(fault.thing)
        nodes = [n for n in self._nodes if fault.node in (None, n.node_id)]
        objects = [(n, n.dictionary.get(*at)) for n in nodes] if at else []
        return [(n, entry) for n, entry in objects if entry is not None and entry.type.numeric]

    def _unpowered(self, channel: str) -> float:
        """Return what a channel reads at 0 digits of the input that has a live zero; 0 without."""
        shown = [entry for node in self._nodes for entry in node.dictionary.showing(channel)]
        return next((entry.offset for entry in shown if entry.offset), 0.0)

    def _end(self, running: Running) -> None:
        self._on_end(running)
        if running in self._waiting:
            self._waiting.remove(running)
            return
        self._running.remove(running)
        self._changes = [c for c in self._changes if c[0] is not running]
        self.parameters.restore({name for _, name, _ in self._changes})
        self._coil = [c for c in self._coil if c[0] is not running]
        self._samples = [c for c in self._samples if c[0] is not running]
        for _, node, distortion in [o for o in self._objects if o[0] is running]:
            distortion.end()
            node.distortions.remove(distortion)
        self._objects = [o for o in self._objects if o[0] is not running]
        for _, node, act in [f for f in self._frames if f[0] is running]:
            self._freed.append((node, *act.end()))
        self._frames = [f for f in self._frames if f[0] is not running]
        if running.fault.kind.emergency:
            for node in self._nodes:
                node.clear_error(running)


def _distorting(running: Running, wrong: Wrong) -> Callable[[int, float], float]:
    """Return a function that distorts the value of an object."""
    return lambda now_ns, value: wrong(running.strength(now_ns), value)


def _upper_ends(plant_: Plant, sensors: Sensors) -> dict[str, float]:
    """Return the upper end of each channel's measuring range; its span if no range is set."""
    records = sensors.parameters.view(plant_.kernel.channel)
    ends = [float(record.measuring_range_upper) for record in records]
    return {c.name: e if math.isfinite(e) else c.span for c, e in zip(CHANNELS, ends, strict=True)}
