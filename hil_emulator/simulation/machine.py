"""Several rigs under one loop, on one or several buses."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from hil_emulator.config.machine import MachineSettings
from hil_emulator.frame import Frame
from hil_emulator.simulation.not_finite import NotFiniteError
from hil_emulator.simulation.rig import FrameDoor, Rig, assemble


class Junction:
    """Lets several rigs share a bus: each hears the bus and the other rigs.

    Args:
        bus: the bus they share.

    """

    def __init__(self, bus: FrameDoor) -> None:
        self._bus = bus
        self._taps: list[Tap] = []

    def tap(self) -> "Tap":
        """Return a further rig's door to the bus."""
        tap = Tap(self)
        self._taps.append(tap)
        return tap

    def collect(self) -> None:
        """Hand what has arrived to every tap: once a tick, so that all hear it in the same one."""
        frames = self._bus.receive()
        if frames:
            for tap in self._taps:
                tap.waiting += frames

    def carry(self, sender: "Tap", frames: Iterable[Frame]) -> None:
        """Send a rig's frames to the bus and to the other rigs."""
        sent = list(frames)
        self._bus.send(sent)
        for tap in self._taps:
            if tap is not sender:
                tap.waiting += sent


class Tap:
    """One rig's door to a shared bus; made by `Junction.tap`.

    Attributes:
        waiting: frames that the rig has not taken yet.

    """

    def __init__(self, junction: Junction) -> None:
        self._junction = junction
        self.waiting: list[Frame] = []

    def receive(self) -> list[Frame]:
        """Return what the junction has collected, and what the other rigs sent."""
        frames, self.waiting = self.waiting, []
        return frames

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames, never wait."""
        self._junction.carry(self, frames)


class Machine:
    """Several rigs that tick together.

    Args:
        rigs: at least one, by name; all with the same tick.
        junctions: the buses that they are on.

    """

    def __init__(self, rigs: Mapping[str, Rig], junctions: Iterable[Junction]) -> None:
        self.rigs = dict(rigs)
        self._junctions = tuple(junctions)
        self.tick_ns = next(iter(rigs.values())).tick_ns

    @property
    def now_ns(self) -> int:
        """Emulator time at which the next tick begins [ns]."""
        return next(iter(self.rigs.values())).now_ns

    def step(self) -> None:
        """Let one tick pass."""
        for junction in self._junctions:
            junction.collect()
        for name, rig in self.rigs.items():
            try:
                rig.step()
            except NotFiniteError as error:
                error.args = (f"{name}: {error}",)
                raise

    def slip(self, total_ns: int) -> None:
        """Take note that emulator time has fallen behind the wall, by so much in all."""
        for rig in self.rigs.values():
            rig.slip(total_ns)

    def serve(self, frames: Sequence[Frame]) -> None:
        """Let all nodes answer frames at the present moment; the plants stand still."""
        for rig in self.rigs.values():
            rig.serve(frames)


def assemble_machine(
    settings: MachineSettings, buses: Mapping[str, FrameDoor], cache: Path | None = None
) -> Machine:
    """Make every rig of a machine; the model is compiled once.

    Args:
        settings: the machine's description.
        buses: an open bus for each name in it.
        cache: folder that keeps the compiled model for the next start.

    Raises:
        UserError: if a node cannot be made from its EDS.

    """
    junctions = {name: Junction(bus) for name, bus in buses.items()}
    rigs = {a.name: assemble(a.config, junctions[a.bus].tap(), cache) for a in settings.actuators}
    return Machine(rigs, junctions.values())
