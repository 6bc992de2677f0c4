"""The emulator inside a test: one object, in lock-step, on a virtual bus of its own."""

import itertools
import os
import warnings
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration
from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.errors import UserError, did_you_mean
from hil_emulator.faults.running import Running
from hil_emulator.platform.paths import cache_folder
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.journal import Recording
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.signals import condition
from hil_emulator.signals.columns import MODEL, columns
from hil_emulator.signals.inputs import setting
from hil_emulator.simulation.assembly import assemble
from hil_emulator.units import axis, read_as, show, to_si

_numbers = itertools.count()

Time = str | float
"""A time with its unit, such as "200 ms", or a number of seconds."""


class NeverHeldError(AssertionError):
    """A condition did not hold in time."""


class Signals:
    """The present values of all recorded signals as attributes, SI.

    `signals.position` is the reading of the sensor, `signals.model.position` the true value.
    """

    def __init__(self, value: Callable[[str], float], prefix: str = "") -> None:
        self._value = value
        self._prefix = prefix

    def __getattr__(self, name: str) -> Any:
        if not self._prefix and name == MODEL.rstrip("."):
            return Signals(self._value, MODEL)
        if self._prefix + name not in columns():
            hint = did_you_mean(self._prefix + name, columns())
            raise AttributeError(f"no signal '{self._prefix}{name}'{hint}")
        return self._value(self._prefix + name)


class Emulator(AbstractContextManager["Emulator"]):
    """A rig in lock-step: time passes in `run_for`, `wait_until` and `tick`, and nowhere else.

    Args:
        config: the rig's description.

    Attributes:
        config: as given.
        rig: the rig itself.
        bus: settings of its virtual bus, for `can.Bus(**settings)` in this process.
        signals: present values of all signals, SI.
        recorder: recording since the start.

    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.bus = {
            "interface": "virtual",
            "channel": f"hil-emulator {os.getpid()} {next(_numbers)}",
        }
        self.recorder = MemoryRecorder()
        self._door = Bus(self.bus)
        self.rig = assemble(config, self._door, cache_folder(), self.recorder)
        self.signals = Signals(self.rig.value)
        self._listeners: list[Callable[[], None]] = []
        self._ticking = False

    @property
    def now(self) -> float:
        """Emulator time [s]."""
        return self.rig.now_ns * 1e-9

    def every_tick(self, call: Callable[[], None]) -> None:
        """Register a function that is called after each tick: a controller, a log."""
        self._listeners.append(call)

    def tick(self) -> None:
        """Execute one tick, then call the registered functions; within such a call, do nothing."""
        if self._ticking:
            return
        self._ticking = True
        try:
            self.rig.step()
            if self.rig.now_ns == self.config.tick_ns:
                self._warn_of_booting_nodes()
            for call in self._listeners:
                call()
        finally:
            self._ticking = False

    def _warn_of_booting_nodes(self) -> None:
        """Warn of commands that arrived while the nodes were still booting."""
        early = [f for _, sent, f in self.recorder.frames if not sent and f.can_id == NMT_COB_ID]
        if early:
            warnings.warn(
                "an NMT command before the first tick: a node receives frames only after its "
                "boot-up message; let a tick pass first", RuntimeWarning, stacklevel=3,
            )  # fmt: skip

    def run_for(self, time: Time) -> None:
        """Advance emulator time.

        Raises:
            UserError: for text that is not a time.

        """
        for _ in range(self._ticks(time)):
            self.tick()

    def wait_until(self, what: str | Callable[[Signals], bool], within: Time = "1 s") -> float:
        """Advance time until a condition holds.

        Args:
            what: a function of the signals, or text such as "position > 60 mm".
            within: longest time to wait.

        Returns:
            The time that it took [s].

        Raises:
            NeverHeldError: if it did not hold in time.
            UserError: for a condition that cannot be read.

        """
        with self._axis:
            holds = self._condition(what)
        begin = self.now
        for _ in range(self._ticks(within)):
            if holds():
                return self.now - begin
            self.tick()
        if holds():
            return self.now - begin
        text = what if isinstance(what, str) else "the condition"
        with self._axis:
            values = ", ".join(
                f"{name} = {show(self.rig.value(name), unit, read_as(unit))}"
                for name, unit in self._watched(what)
            )
        raise NeverHeldError(f"{text} did not hold within {within}; at {self.now:.3f} s {values}")

    def fault(self, target: str, kind: str, /, **options: Any) -> Running:
        """Inject a fault, until the block ends; see `hil_emulator.faults.fault.fault`."""
        with self._axis:
            return self.rig.fault(target, kind, **options)

    def set(self, name: str, value: str) -> None:
        """Set a condition of the surroundings, such as `set("supply_pressure", "120 bar")`.

        Warns of a set point that waits for a node which is not OPERATIONAL.

        Raises:
            UserError: for an unknown setting or a wrong unit.

        """
        with self._axis:
            waits = self.rig.set(name, setting(name, value))
        if waits:
            warnings.warn(waits, RuntimeWarning, stacklevel=2)

    def recording(self) -> Recording:
        """Return the recording since the start."""
        return remembered(self.recorder, header(self.config, self.rig.nodes))

    def close(self) -> None:
        """Leave the bus, and end an FMU."""
        self._door.close()
        self.rig.plant.supply.close()

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def _axis(self) -> AbstractContextManager[None]:
        """Context in which quantities are those of the machine's axis."""
        return axis(rotary=self.config.rotary)

    def _condition(self, what: str | Callable[[Signals], bool]) -> Callable[[], bool]:
        if callable(what):
            return lambda: what(self.signals)
        parsed = condition.parse(what)
        return lambda: parsed.holds(self.rig.value)

    def _ticks(self, time: Time) -> int:
        try:
            seconds = to_si(time, "s", "200 ms") if isinstance(time, str) else time
        except ValueError as error:
            raise UserError(str(error)) from None
        return round(seconds * 1e9 / self.config.tick_ns)

    def _watched(self, what: object) -> list[tuple[str, str]]:
        units: Mapping[str, str] = columns()
        if isinstance(what, str):
            return [(name, units[name]) for name, _, _ in condition.parse(what).terms]
        return [(n, units[n]) for n in self.rig.sensors.names]
