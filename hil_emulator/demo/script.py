"""What the demonstration does, and how well the controller did."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load_whole
from hil_emulator.platform.paths import shipped
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.journal import Recording
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.signals.columns import MODEL
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import LockStep
from hil_emulator.simulation.loop import Timing, run
from hil_emulator.simulation.reference_controller import Controller

Signal = NDArray[np.float64]

_CHANNEL = "hil-emulator demo"


@dataclass(frozen=True)
class SetPointStep:
    """One set-point step: what is controlled, when, from where to where (SI)."""

    quantity: str
    start: float
    end: float
    before: float
    after: float


STEPS = (
    SetPointStep("position", 0.2, 0.8, 0.040, 0.050),
    SetPointStep("position", 0.8, 1.6, 0.050, 0.034),
    SetPointStep("position", 1.6, 2.2, 0.034, 0.040),
    SetPointStep("load_force", 2.2, 3.0, 0.0, 600.0),
)
"""The set points; before the first one the rod stands still at mid-stroke."""

SETTLED = {"position": 0.05, "load_force": 0.10}
"""Share of a step within which the response must stay; the force carries the load cell's noise."""

LIMITS = {"position": (0.35, 0.10), "load_force": (0.35, 0.20)}
"""Settling time [s] and overshoot that count as a pass."""


HOLDING = 0.25
"""Time at the end of a step in which the actuator has to hold still [s]."""

STILL = {"position": 20e-6, "pressure_a": 2e5, "pressure_b": 2e5}
"""Root mean square around a straight line [m, Pa] that counts as still: six steps of the position
sensor, twenty times the noise of the pressure sensors. A limit cycle hides in neither."""


@dataclass(frozen=True)
class Response:
    """How a step went.

    Attributes:
        step: what was asked.
        settling: time until it stayed near its end [s]; inf if it never did.
        overshoot: as share of the step.
        wander: root mean square around a straight line at its end, by what has to be `STILL`.

    """

    step: SetPointStep
    settling: float
    overshoot: float
    wander: Mapping[str, float]

    @property
    def passed(self) -> bool:
        """Whether it is within the limits, and holds still."""
        settling, overshoot = LIMITS[self.step.quantity]
        steady = all(self.wander[name] <= most for name, most in STILL.items())
        return self.settling <= settling and self.overshoot <= overshoot and steady


@dataclass(frozen=True)
class Demonstration:
    """A finished demonstration: signals, responses, what went wrong on the bus, all recorded."""

    table: dict[str, Signal]
    responses: tuple[Response, ...]
    missed: int
    emergencies: int
    recording: Recording

    @property
    def passed(self) -> bool:
        """Whether every response is good, no PDO was missed and no emergency was sent."""
        return all(r.passed for r in self.responses) and not self.missed and not self.emergencies


def set_point(time: float) -> tuple[str, float]:
    """Return what is controlled at a time [s], and its set point."""
    for step in reversed(STEPS):
        if time >= step.start:
            return step.quantity, step.after
    return "position", STEPS[0].before


def wander(time: Signal, values: Signal) -> float:
    """Return the root mean square of a signal around a straight line."""
    line = np.polynomial.Polynomial.fit(time, values, 1)
    return float(np.sqrt(np.mean((values - line(time)) ** 2)))


def respond(step: SetPointStep, table: Mapping[str, Signal]) -> Response:
    """Measure a step response in a recording: what the model did, not what was read of it."""
    time, values = table["time"], table[MODEL + step.quantity]
    inside = (time >= step.start) & (time < step.end)
    height = step.after - step.before
    progress = (values[inside] - step.before) / height
    outside = np.flatnonzero(np.abs(progress - 1.0) > SETTLED[step.quantity])
    last = outside[-1] + 1 if len(outside) else 0
    settled = last < len(progress)
    settling = float(time[inside][last] - step.start) if settled else float("inf")
    end = inside & (time >= step.end - HOLDING)
    still = {name: wander(time[end], table[MODEL + name][end]) for name in STILL}
    return Response(step, settling, max(0.0, float(progress.max()) - 1.0), still)


def perform(cache: Path, report: Callable[[str], None]) -> Demonstration:
    """Run emulator and controller in lock-step on an in-process bus."""
    files = [shipped("configs/hyq_knee.toml"), shipped("configs/spring_load.toml")]
    config = load_whole(files)
    settings = {"interface": "virtual", "channel": _CHANNEL}
    recorder = MemoryRecorder()
    period = config.tick_ns * 1e-9
    with Bus(settings) as emulator_bus, Bus(settings) as controller_bus:
        report("Preparing the model (a few seconds the first time) ...")
        rig = assemble(config, emulator_bus, cache, recorder)
        controller = Controller(controller_bus, config.nodes[0].id)
        timing = Timing()
        report("Controlling position, then force, through CAN frames ...")
        while rig.now_ns * 1e-9 < STEPS[-1].end:
            run(rig, LockStep(), 1, timing)
            controller.listen()
            time = rig.now_ns * 1e-9
            if timing.ticks == 10:
                controller.start_node()
            elif timing.ticks > 20:
                quantity, target = set_point(time)
                if quantity == "position":
                    controller.hold_position(target)
                else:
                    controller.hold_force(target, period)
    table = recorder.table()
    responses = tuple(respond(s, table) for s in STEPS)
    recording = remembered(recorder, header(config, rig.nodes))
    return Demonstration(
        table, responses, controller.missed, len(controller.emergencies), recording
    )
