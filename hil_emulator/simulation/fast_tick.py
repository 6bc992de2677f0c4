"""Tick of a rig whose only node is on its fast path, in as few steps as possible.

It does the work of `Rig.step` for the usual case. Other cases are left to the rig, before the tick
or at the point of the tick where they are detected.
"""

from collections.abc import Callable
from typing import Protocol

from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.faults.active import Faults
from hil_emulator.frame import NO_FRAMES
from hil_emulator.model.digits import NOT_FINITE
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.partners.partner import Partner
from hil_emulator.recording.memory import Recorder
from hil_emulator.simulation.timed_can_port import CanPort

NS_PER_US = 1_000


class TickingRig(Protocol):
    """Interface of the rig for the fast path: see `Rig`."""

    plant: Plant
    sensors: Sensors
    nodes: tuple[Node, ...]
    partners: tuple[Partner, ...]
    faults: Faults
    bus: CanPort
    wire: TimedWire | None
    recorder: Recorder | None
    measured: Measured | None
    left_stroke_ns: int | None
    now_ns: int
    tick_ns: int

    def sample(self) -> Measured:
        """Return the last sample."""
        ...

    def publish(self, finite: bool) -> None:
        """End a tick."""
        ...

    def conclude(self, finite: bool) -> None:
        """End a tick in which the sensors have sampled."""
        ...


def fast_tick(rig: TickingRig, node: Node, steps: int) -> Callable[[], bool]:
    """Return a function that executes a tick, or returns False, without effect, if it cannot.

    Args:
        rig: the rig, on a bus without modelled timing.
        node: its only node, which is on its fast path.
        steps: integration steps per tick.

    """
    fast_path, faults, sensors, bus = node.fast_path, rig.faults, rig.sensors, rig.bus
    record, tick_ns = sensors.record, rig.tick_ns
    # faster than numpy's assignment of an element
    inputs: memoryview[float] = rig.plant.input_vector.data.cast("B").cast("d")
    place = rig.plant.input_places
    # looked up once instead of in every tick
    receive, hear = bus.receive, node.receive
    repeat, send = node.repeat, bus.send
    pass_and_sample = sensors.after(rig.plant.supply, steps)

    def tick() -> bool:
        now_ns = rig.now_ns
        if not fast_path.until_ns or faults.active or rig.bus is not bus:
            return False
        recorder = rig.recorder
        frames = receive()
        if recorder and frames:
            recorder.bus(now_ns, frames, sent=False)
        for name, value in hear(now_ns, frames).items():
            inputs[place[name]] = value
        ranges = pass_and_sample(now_ns // NS_PER_US)
        if ranges == NOT_FINITE:
            rig.publish(False)
            return True
        rig.measured = None
        if ranges or not fast_path.until_ns:
            rig.conclude(True)
            return True
        sent = repeat(now_ns, record)
        if sent is not NO_FRAMES:
            send(sent)
        if recorder:
            if sent is not NO_FRAMES:
                recorder.bus(now_ns, sent, sent=True)
            recorder.row(now_ns, rig.plant, sensors.reading)
        rig.now_ns = now_ns + tick_ns
        return True

    return tick
