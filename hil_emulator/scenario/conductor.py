"""The steps of a scenario on a rig, and the reference controller where it acts."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.faults.running import Running
from hil_emulator.frame import Frame
from hil_emulator.scenario.names import NMT, frame_of
from hil_emulator.scenario.outcome import Curve, Span
from hil_emulator.scenario.profile import read_profile
from hil_emulator.scenario.schema import Role, Scenario, SignalProfile, Step
from hil_emulator.signals.inputs import SET_POINTS
from hil_emulator.simulation.reference_controller import Controller
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort

_NANO = 1e9


class Begins(Protocol):
    """Interface of what has to know when a scenario and its steps begin: see `Judge.begin`."""

    def begin(self, now_ns: int, step: str = "") -> None:
        """Take the time [ns] of the start, or of a step."""
        ...


class Conductor:
    """Plays the steps of a scenario: call `before` and `after` around each tick of the rig.

    Args:
        rig: on which it is played.
        port: of the scenario and the reference controller on the rig's bus.
        scenario: to play.
        folder: of its files.
        role: which controller acts.
        judge: has to know when the scenario and its steps begin.
        report: called with time [s] and description of each step taken.

    Attributes:
        begun_ns: emulator time at which the scenario began; None before.
        events: time [s] and description of each step taken.

    Raises:
        UserError: for a step that the role cannot play.

    """

    def __init__(
        self, rig: Rig, port: CanPort, scenario: Scenario, folder: Path, role: Role, judge: Begins,
        report: Callable[[float, str], None] = lambda now, words: None,
    ) -> None:  # fmt: skip
        _refuse(scenario, role)
        self.begun_ns: int | None = None
        self.events: list[tuple[float, str]] = []
        self._rig, self._port, self._folder, self._judge = rig, port, folder, judge
        self._scenario, self._role, self._report = scenario, role, report
        self._duration_ns = round(scenario.duration * _NANO)
        self._latest_ns = rig.now_ns + round(scenario.patience * _NANO)
        self._reference = Controller(port, rig.nodes[0].node_id) if role == "reference" else None
        # where no step starts the nodes, the controller has to
        self._starts = role == "reference" and not any(step.nmt for step in scenario.steps)
        self._waiting = list(scenario.steps)
        self._faults: list[tuple[Running, float | None]] = []
        self._set_point: tuple[str, float] | None = None
        self._silent = False
        self._profiles: list[tuple[SignalProfile, float, Curve, Curve]] = []

    @property
    def now(self) -> float:
        """Time of the scenario [s]; 0 before it has begun."""
        return 0.0 if self.begun_ns is None else (self._rig.now_ns - self.begun_ns) / _NANO

    @property
    def over(self) -> bool:
        """Whether the scenario has taken its duration."""
        begun_ns = self.begun_ns
        return begun_ns is not None and self._rig.now_ns >= begun_ns + self._duration_ns

    def before(self) -> None:
        """Take the due steps before a tick, once the scenario has begun.

        Raises:
            UserError: if no controller has come in time.

        """
        if self.begun_ns is None and not self._begins():
            return
        for step in [s for s in self._waiting if self._due(s)]:
            self._waiting.remove(step)
            self._take(step)
        self._follow()
        self._control()

    def after(self) -> None:
        """Take note of what has happened in a tick."""
        if self._reference:
            self._reference.listen()
        else:
            self._port.receive()
        for i, (running, ended) in enumerate(self._faults):
            if ended is None and running.ended:
                self._faults[i] = running, self.now

    def give_up(self) -> None:
        """Refuse to wait any longer for the controller.

        Raises:
            UserError: describes what was waited for, and the nodes.

        """
        states = ", ".join(
            f"node {n.node_id} is {n.state.name.lower().replace('_', '-')}" for n in self._rig.nodes
        )
        raise UserError(
            f"no controller within {self._scenario.patience:g} s: it has to start a node and send "
            f"a set point ({states}); start your controller, or raise patience"
        )

    def faults(self) -> list[Span]:
        """Return the faults with their times in the scenario."""
        begun_ns = self.begun_ns or 0
        return [
            Span(
                (running.began_ns - begun_ns) / _NANO,
                self._scenario.duration if ended is None else ended,
                f"{running.fault.target} {running.fault.kind.name}",
            )
            for running, ended in self._faults
            if running.began_ns is not None
        ]

    def _begins(self) -> bool:
        """Return whether the scenario begins with this tick."""
        waits = self._scenario.needs and self._role != "reference"
        if waits and not any(node.commanded for node in self._rig.nodes):
            if self._rig.now_ns >= self._latest_ns:
                self.give_up()
            return False
        self.begun_ns = self._rig.now_ns
        self._judge.begin(self.begun_ns)
        return True

    def _due(self, step: Step) -> bool:
        late_enough = self.now >= step.at - 1e-9
        return late_enough and (step.when is None or step.when.holds(self._rig.value))

    def _take(self, step: Step) -> None:
        left = self._role == "external" and step.set_point
        words = f"{step.words} (left to your controller)" if left else step.words
        self.events.append((self.now, words))
        self._report(self.now, words)
        if step.name:
            self._judge.begin(self._rig.now_ns, step.name)
        for name, value in step.set.items():
            if name not in SET_POINTS:
                self._rig.set(name, value)
        self._set_point = step.set_point or self._set_point
        if step.fault is not None:
            self._faults.append((self._rig.inject(step.fault), None))
        if step.nmt is not None:
            self._port.send([Frame(0x000, bytes([NMT[step.nmt], 0]))])
        self._port.send(frame_of(line) for line in step.send)
        if step.controller is not None:
            self._silent = step.controller == "off"
        if step.profile is not None:
            curve = read_profile(self._folder, step.profile)
            self._profiles.append((step.profile, self.now, *curve))

    def _follow(self) -> None:
        for profile, begin, times, values in self._profiles:
            value = float(np.interp(self.now - begin, times, values))
            if profile.signal in SET_POINTS:
                self._set_point = profile.signal, value
            else:
                self._rig.set(profile.signal, value)

    def _control(self) -> None:
        """Let the reference controller start its node, and send its set point."""
        if self._starts and self._reference and self._rig.now_ns:  # the node has booted
            self._reference.start_node()
            self._starts = False
        if self._set_point is None or self._silent or self._reference is None:
            return
        name, value = self._set_point
        if name == "position":
            self._reference.hold_position(value)
        elif name == "load_force":
            self._reference.hold_force(value, self._rig.tick_ns / _NANO)
        else:
            counts = struct.pack("<i", round(value * _NANO))
            self._port.send([Frame(0x200 + self._rig.nodes[0].node_id, counts)])


def _refuse(scenario: Scenario, role: Role) -> None:
    """Refuse steps that need a controller which does not act.

    Raises:
        UserError: names the step and the way out.

    """
    if role == "reference":
        return
    for number, step in enumerate(scenario.steps):
        if step.set_point and role != "external":
            raise UserError(f"step.{number}: {step.set_point[0]} needs a controller to follow it")
        if step.controller:
            raise UserError(
                f'step.{number}: controller = "{step.controller}" silences the reference '
                f"controller only; to lose the set points of another one, write "
                "fault = \"rpdo1 drop duration='100 ms'\""
            )
