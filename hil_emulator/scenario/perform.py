"""Run of one scenario in lock-step: emulator, controller on its bus, and timed steps."""

import dataclasses
import hashlib
import struct
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration, load_rig
from hil_emulator.errors import UserError
from hil_emulator.faults.running import Running
from hil_emulator.frame import Frame
from hil_emulator.platform.output_files import new_files
from hil_emulator.recording import SUFFIX, exports, journal
from hil_emulator.scenario import schema
from hil_emulator.scenario.judge import bands, judge
from hil_emulator.scenario.outcome import Curve, Outcome, Span
from hil_emulator.scenario.schema import NMT, Scenario, SignalProfile, Step
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.simulation.not_finite import PlantFailedError
from hil_emulator.simulation.reference_controller import Controller
from hil_emulator.units import show

DRAWN = (
    "position", "model.position", "load_force", "pressure_a", "pressure_b", "supply_pressure",
    "valve_current",
)  # fmt: skip
"""The signals that pictures show."""

_POINTS = 600  # per curve of a picture
_NANO = 1e9


class Conductor:
    """Plays the steps of a scenario, and controls the actuator.

    Args:
        emulator: on which it is played.
        scenario: to play.
        folder: of its files.

    Attributes:
        events: time [s] and description of each step taken.
        faults: each fault, and when it ended [s]; None while it lasts.

    """

    def __init__(self, emulator: Emulator, scenario: Scenario, folder: Path) -> None:
        self.events: list[tuple[float, str]] = []
        self.faults: list[tuple[Running, float | None]] = []
        self._emulator = emulator
        self._folder = folder
        self._bus = Bus(emulator.bus)
        self._nodes = [n.id for n in emulator.config.nodes]
        self._controller = Controller(self._bus, self._nodes[0])
        self._period = emulator.config.tick_ns / _NANO
        self._waiting = list(scenario.steps)
        self._set_point: tuple[str, float] | None = None
        self._silent = False
        self._profiles: list[tuple[SignalProfile, float, Curve, Curve]] = []

    def play(self, duration: float) -> None:
        """Let emulator time pass, and take due steps before each tick."""
        while self._emulator.rig.now_ns < round(duration * _NANO):
            for step in [s for s in self._waiting if self._due(s)]:
                self._waiting.remove(step)
                self._take(step)
            self._follow()
            self._control()
            self._emulator.tick()
            self._controller.listen()
            self._watch_faults()

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()

    def _watch_faults(self) -> None:
        """Note the faults that have ended in this tick."""
        for i, (running, ended) in enumerate(self.faults):
            if ended is None and running.ended:
                self.faults[i] = running, self._emulator.now

    def _due(self, step: Step) -> bool:
        late_enough = self._emulator.now >= step.at - 1e-9
        return late_enough and (step.when is None or step.when.holds(self._emulator.rig.value))

    def _take(self, step: Step) -> None:
        self.events.append((self._emulator.now, step.words))
        for name, value in step.set.items():
            if name in SET_POINTS:
                self._set_point = name, value
            else:
                self._emulator.rig.set(name, value)
        if step.fault is not None:
            self.faults.append((self._emulator.rig.inject(step.fault), None))
        if step.nmt is not None:
            self._bus.send([Frame(0x000, bytes([NMT[step.nmt], 0]))])
        if step.controller is not None:
            self._silent = step.controller == "off"
        if step.profile is not None:
            self._profiles.append(
                (step.profile, self._emulator.now, *_profile(self._folder, step.profile))
            )

    def _follow(self) -> None:
        for profile, begin, times, values in self._profiles:
            value = float(np.interp(self._emulator.now - begin, times, values))
            if profile.signal in SET_POINTS:
                self._set_point = profile.signal, value
            else:
                self._emulator.rig.set(profile.signal, value)

    def _control(self) -> None:
        if self._set_point is None or self._silent:
            return
        name, value = self._set_point
        if name == "position":
            self._controller.hold_position(value)
        elif name == "load_force":
            self._controller.hold_force(value, self._period)
        else:
            counts = struct.pack("<i", round(value * _NANO))
            self._bus.send([Frame(0x200 + self._nodes[0], counts)])


def rig_of(scenario: Scenario, folder: Path) -> Configuration:
    """Return the rig for a scenario of a folder, with the scenario's own seed."""
    config = load_rig([folder / name for name in scenario.config])
    return config if scenario.seed is None else dataclasses.replace(config, seed=scenario.seed)


def recordings_of(file: Path, folder: Path) -> tuple[Path, Path]:
    """Return the files of a scenario's recording: the journal and a table."""
    return folder / f"{file.stem}{SUFFIX}", folder / f"{file.stem}.csv"


def perform(file: Path, recordings: Path | None = None, *, overwrite: bool = False) -> Outcome:
    """Run a scenario; an error of the input is an outcome too.

    Args:
        file: the scenario.
        recordings: folder for its recording, see `recordings_of`; without it none is written.
        overwrite: whether an existing recording is replaced.

    """
    begin = time.perf_counter()
    try:
        scenario = schema.load(file)
        with Emulator(rig_of(scenario, file.parent)) as emulator:
            conductor = Conductor(emulator, scenario, file.parent)
            try:
                conductor.play(scenario.duration)
            finally:
                conductor.close()
            if recordings is not None:
                _keep(emulator, recordings_of(file, recordings), overwrite=overwrite)
            # the last signals before the failure may meet every expectation
            if emulator.rig.plant.supply.failure:
                raise PlantFailedError(emulator.rig.plant.supply.failure)
            return _outcome(file, scenario, emulator, conductor, begin)
    except UserError as error:
        return Outcome(str(file), file.stem, error=str(error))


def _outcome(
    file: Path, scenario: Scenario, emulator: Emulator, conductor: Conductor, begin: float
) -> Outcome:
    recorder = emulator.recorder
    table = recorder.table()
    digest = hashlib.sha256(repr(recorder.frames).encode())
    digest.update(recorder.rows().tobytes())
    shown = ("time", *DRAWN, *(e.signal for e in scenario.expectations if e.signal))
    thin = slice(None, None, max(1, len(table["time"]) // _POINTS))
    return Outcome(
        file=str(file),
        title=scenario.title,
        checks=judge(scenario.expectations, recorder),
        digest=digest.hexdigest()[:16],
        duration=scenario.duration,
        elapsed=time.perf_counter() - begin,
        curves={name: table[name][thin].copy() for name in dict.fromkeys(shown)},
        events=tuple(conductor.events),
        faults=tuple(_spans(conductor, scenario.duration)),
        bands=tuple(bands(scenario.expectations, table, scenario.duration)),
    )


def _spans(conductor: Conductor, duration: float) -> Iterator[Span]:
    """Yield the faults with their times."""
    for running, ended in conductor.faults:
        if running.began_ns is not None:
            words = f"{running.fault.target} {running.fault.kind.name}"
            yield Span(running.began_ns / _NANO, duration if ended is None else ended, words)


def _keep(emulator: Emulator, files: tuple[Path, Path], *, overwrite: bool) -> None:
    """Write the recording.

    Raises:
        UserError: if a file exists or cannot be written.

    """
    with new_files(overwrite=overwrite) as staged:
        whole, table = map(staged, files)
        journal.write(emulator.recording(), whole)
        exports.write(whole, table)


def _profile(folder: Path, profile: SignalProfile) -> tuple[Curve, Curve]:
    """Return time [s] and value of a profile.

    Raises:
        UserError: if the file does not have two columns of numbers under a header, or exceeds the
            bounds of its signal.

    """
    file = folder / profile.file
    try:
        input_files.check(file, input_files.COURSE)
        with warnings.catch_warnings(action="ignore"):  # of a file without rows
            rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        times, values = rows.T
    except (OSError, ValueError) as error:
        raise UserError(
            f"{file}: not a profile: {error}; it has a header and the columns time [s] and value"
        ) from None
    param = (SETTINGS | SET_POINTS)[profile.signal]
    bounded = param.allows(values.min()) and param.allows(values.max())
    if not (bounded and np.isfinite(times).all()):
        low, high = (show(v, param.unit, param.shown) for v in (param.low, param.high))
        raise UserError(f"{file}: {profile.signal} has to stay within {low} ... {high}")
    return times, values
