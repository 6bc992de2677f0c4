"""Several rigs under one loop, on one or several buses."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.config.machine import MachineSettings
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Supply, on_one_supply
from hil_emulator.model.sampling import Sensors
from hil_emulator.simulation.active_effects import acting_together
from hil_emulator.simulation.assembly import assemble_together, compiled
from hil_emulator.simulation.not_finite import NotFiniteError
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort, TimedCanPort


class Junction:
    """Lets several rigs share a bus: each receives the frames of the bus and of the other rigs.

    Args:
        bus: the shared bus.

    """

    def __init__(self, bus: CanPort) -> None:
        self._bus = bus
        self._taps: list[Tap] = []

    def tap(self) -> "Tap":
        """Return a further rig's port on the bus."""
        tap = Tap(self)
        self._taps.append(tap)
        return tap

    def collect(self) -> None:
        """Pass the received frames to every tap, once per tick."""
        frames = self._bus.receive()
        if frames:
            for tap in self._taps:
                tap.waiting += frames

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        self._bus.report(error_class)

    def carry(self, sender: "Tap", frames: Iterable[Frame]) -> None:
        """Send a rig's frames to the bus and to the other rigs."""
        sent = list(frames)
        self._bus.send(sent)
        for tap in self._taps:
            if tap is not sender:
                tap.waiting += sent


class Tap:
    """One rig's port on a shared bus; made by `Junction.tap`.

    Attributes:
        waiting: frames that the rig has not taken yet.

    """

    def __init__(self, junction: Junction) -> None:
        self._junction = junction
        self.waiting: list[Frame] = []

    def receive(self) -> list[Frame]:
        """Return the frames of the bus and of the other rigs."""
        frames, self.waiting = self.waiting, []
        return frames

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames without waiting."""
        self._junction.carry(self, frames)

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        self._junction.report(error_class)


class Machine:
    """Several rigs that tick together.

    Args:
        rigs: at least one, by name; all with the same tick.
        junctions: their buses, except those with modelled timing.

    Attributes:
        wires: of buses with modelled timing, by name.

    """

    def __init__(
        self,
        rigs: Mapping[str, Rig],
        junctions: Iterable[Junction],
        wires: Mapping[str, TimedWire] | None = None,
    ) -> None:
        self.rigs = dict(rigs)
        self.wires = dict(wires or {})
        self._junctions = tuple(junctions)
        self.tick_ns = next(iter(rigs.values())).tick_ns

    @property
    def now_ns(self) -> int:
        """Emulator time at which the next tick begins [ns]."""
        return next(iter(self.rigs.values())).now_ns

    def step(self) -> None:
        """Execute one tick, as `Rig.step`, in all rigs together.

        Raises:
            NotFiniteError: names the actuator whose state is not finite.

        """
        for junction in self._junctions:
            junction.collect()
        for rig in self.rigs.values():
            rig.receive()
        finite: dict[Supply, bool] = {}
        for rig in self.rigs.values():
            if rig.plant.supply not in finite:
                finite[rig.plant.supply] = rig.integrate()
        rigs = list(self.rigs.items())
        if not all(finite.values()):  # the rig with the largest delay was late first
            rigs.sort(key=lambda named: int(np.isfinite(named[1].plant.state_vector).sum()))
        for name, rig in rigs:
            try:
                rig.publish(finite[rig.plant.supply])
            except NotFiniteError as error:
                error.args = (f"{name}: {error}",)
                raise

    def slip(self, total_ns: int) -> None:
        """Store the total delay of emulator time behind real time."""
        for rig in self.rigs.values():
            rig.slip(total_ns)

    def serve(self, frames: Sequence[Frame]) -> None:
        """Make all nodes answer frames at the present time, without a step of the plants."""
        for rig in self.rigs.values():
            rig.serve(frames)


def prepare(settings: MachineSettings, cache: Path | None = None) -> None:
    """Compile every model of a machine, which may take a minute, before the run begins.

    A model is compiled at its first call, so each is integrated and sampled once.
    """
    configs = {a.name: a.config for a in settings.actuators}
    for names in by_supply(settings):
        first, *others = acting_together([configs[n] for n in names])
        model = compiled(first.effects, cache, len(names))
        plant, *_ = on_one_supply(model, [c.plant for c in (first, *others)], first.step)
        plant.step(1)
        period, random = first.tick_ns * 1e-9, np.random.default_rng(first.seed)
        Sensors(model, first.sensors, period, random).sample(plant.signal_vector, plant.path)


def assemble_machine(
    settings: MachineSettings, buses: Mapping[str, CanPort], cache: Path | None = None
) -> Machine:
    """Create every rig of a machine; compile one model per number of actuators on a supply.

    Args:
        settings: the machine's description.
        buses: an open bus for each name in it.
        cache: folder of compiled models.

    Raises:
        UserError: if a node cannot be created from its EDS.

    """
    timed = {n: TimedCanPort(buses[n], wire) for n, wire in settings.wires.items() if wire.modelled}
    junctions = {name: Junction(bus) for name, bus in buses.items() if name not in timed}
    ports: dict[str, CanPort] = {}
    configs = {}
    for actuator in settings.actuators:
        wire = settings.wires[actuator.bus]
        configs[actuator.name] = dataclasses.replace(actuator.config, wire=wire)
        junction = junctions.get(actuator.bus)
        ports[actuator.name] = junction.tap() if junction else timed[actuator.bus]
    rigs: dict[str, Rig] = {}
    for names in by_supply(settings):
        made = assemble_together([configs[n] for n in names], [ports[n] for n in names], cache)
        rigs |= dict(zip(names, made, strict=True))
    in_order = {actuator.name: rigs[actuator.name] for actuator in settings.actuators}
    return Machine(in_order, junctions.values(), {n: port.wire for n, port in timed.items()})


def by_supply(settings: MachineSettings) -> list[list[str]]:
    """Return the names of the actuators on each supply; a separate supply has one actuator."""
    names: dict[object, list[str]] = {}
    for actuator in settings.actuators:
        names.setdefault(actuator.supply or (actuator.name,), []).append(actuator.name)
    return list(names.values())
