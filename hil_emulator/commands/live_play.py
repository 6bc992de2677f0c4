"""A scenario on a rig that runs on a live bus, with its progress on the terminal."""

import select
import sys
import time
from pathlib import Path

from hil_emulator.recording.several import Recorders
from hil_emulator.scenario.outcome import Check, Outcome
from hil_emulator.scenario.performance import Performance
from hil_emulator.scenario.schema import Role, Scenario
from hil_emulator.simulation.machine import Junction
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort


class ScenarioOver(Exception):  # noqa: N818  # it is no error
    """The scenario has taken its duration."""


class LivePlay:
    """Plays a scenario between the ticks of a running rig; for the loop it is the rig.

    Args:
        file: of the scenario.
        scenario: to play.
        role: which controller acts.

    Attributes:
        started: whether it has begun on a rig.

    """

    def __init__(self, file: Path, scenario: Scenario, role: Role) -> None:
        self._file, self._scenario, self._role = file, scenario, role
        self._lines: list[str] = []
        self._began = time.monotonic()
        self.started = False
        self._junction: Junction
        self._rig: Rig
        self._performance: Performance

    def port(self, bus: CanPort) -> CanPort:
        """Return the rig's port on a bus, which it shares with the scenario."""
        self._junction = Junction(bus)
        return self._junction.tap()

    def start(self, rig: Rig) -> None:
        """Begin on a rig.

        Raises:
            UserError: for what the rig lacks, or the role cannot play.

        """
        self._rig = rig
        self._performance = Performance(
            self._file, self._scenario, rig, self._junction.tap(), self._role, self._step_taken
        )
        present = [rig.recorder] if rig.recorder else []
        rig.recorder = Recorders(*present, *self._performance.recorders)
        self._began, self.started = time.monotonic(), True
        self._lines.append(f"scenario  {self._scenario.title}")
        if self._scenario.needs and self._role != "reference":
            self._lines.append(f"waits     for a controller, {self._scenario.patience:g} s at most")
        self.serve()

    @property
    def now_ns(self) -> int:
        """Emulator time at which the next tick begins [ns]."""
        return self._rig.now_ns

    @property
    def tick_ns(self) -> int:
        """Period of the loop [ns]."""
        return self._rig.tick_ns

    def slip(self, total_ns: int) -> None:
        """Store the total delay of emulator time behind real time."""
        self._rig.slip(total_ns)

    def step(self) -> None:
        """Let one tick pass.

        Raises:
            ScenarioOver: at the end of the scenario.
            UserError: if no controller has come in time.

        """
        conductor = self._performance.conductor
        self._junction.collect()
        conductor.before()
        self._rig.step()
        conductor.after()
        if conductor.over:
            self._performance.judge.end()
            self.serve()
            raise ScenarioOver

    def serve(self) -> None:
        """Print what has happened, unless the terminal would block the loop.

        Raises:
            UserError: if time stands still, as no SYNC comes, for longer than the patience.

        """
        self._note_settled()
        if self._lines and select.select([], [sys.stdout], [], 0)[1]:
            print("\n".join(self._lines), flush=True)
            self._lines.clear()
        conductor, waited = self._performance.conductor, time.monotonic() - self._began
        if conductor.begun_ns is None and waited > self._scenario.patience:
            conductor.give_up()

    def outcome(self, error: str) -> Outcome:
        """Return the outcome; print what has not been printed yet.

        Args:
            error: why it ended early; "" if it did not.

        """
        if not (error or self._performance.conductor.over):
            error = f"interrupted at {self._performance.conductor.now:.3f} s"
        failure = self._rig.plant.supply.failure
        outcome = self._performance.outcome(time.monotonic() - self._began, error or failure)
        self._note_settled()
        if self._lines:
            print("\n".join(self._lines), flush=True)
        return outcome

    def _step_taken(self, now: float, words: str) -> None:
        self._lines.append(f"{now:9.3f} s  step    {words}")

    def _note_settled(self) -> None:
        judge, now = self._performance.judge, self._performance.conductor.now
        self._lines += [f"{now:9.3f} s  {_verdict(c)}" for c in judge.settled]
        judge.settled.clear()


def _verdict(c: Check) -> str:
    return f"{'met   ' if c.passed else 'MISSED'}  {c.text}: {c.observed}"
