"""One scenario on one rig: its steps, its expectations, and the curves for its picture."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.recording.memory import Recorder
from hil_emulator.scenario.conductor import Conductor
from hil_emulator.scenario.judge import Judge
from hil_emulator.scenario.outcome import Curve, Outcome
from hil_emulator.scenario.schema import Role, Scenario
from hil_emulator.signals.columns import Readings, columns, fill_row
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort
from hil_emulator.units import is_rotary

DRAWN = (
    "position", "model.position", "load_force", "pressure_a", "pressure_b", "supply_pressure",
    "valve_current",
)  # fmt: skip
"""The signals that pictures show."""

_POINTS = 600  # per curve of a picture


class Performance:
    """Plays one scenario on one rig, in any clock.

    Args:
        file: of the scenario.
        scenario: to play.
        rig: on which it is played.
        port: of the scenario on the rig's bus.
        role: which controller acts.
        report: called with time [s] and description of each step taken.

    Attributes:
        conductor: plays the steps, around each tick.
        judge: observes the expectations.
        recorders: recorders that the rig needs for this.

    Raises:
        UserError: for what the rig lacks, or the role cannot play.

    """

    def __init__(
        self, file: Path, scenario: Scenario, rig: Rig, port: CanPort, role: Role,
        report: Callable[[float, str], None] = lambda now, words: None,
    ) -> None:  # fmt: skip
        if not rig.nodes and (role == "reference" or scenario.needs):
            raise UserError(
                "the reference controller, and needs, require a CANopen node: add a [[node]]"
            )
        self._file, self._scenario = file, scenario
        self.judge = Judge(scenario.expectations, rig)
        self.conductor = Conductor(rig, port, scenario, file.parent, role, self.judge, report)
        ticks = round(scenario.duration * 1e9) // rig.tick_ns
        shown = (*DRAWN, *(e.signal for e in scenario.expectations if e.signal))
        self._curves = CurveRecorder(["time", *dict.fromkeys(shown)], max(1, ticks // _POINTS))
        self.recorders: tuple[Recorder, ...] = (self.judge, self._curves)

    def outcome(self, elapsed: float, error: str = "") -> Outcome:
        """Return the outcome, after a computing time [s]."""
        self.judge.end()
        duration = self.conductor.now if error else self._scenario.duration
        return Outcome(
            file=str(self._file),
            title=self._scenario.title,
            checks=self.judge.checks,
            error=error,
            duration=duration,
            elapsed=elapsed,
            curves=self._curves.since(self.conductor.begun_ns or 0),
            events=tuple(self.conductor.events),
            faults=tuple(self.conductor.faults()),
            bands=tuple(self.judge.spans(duration)),
            rotary=is_rotary(),
        )


class CurveRecorder:
    """Keeps some signals of every n-th tick.

    Args:
        names: of the signals, time first.
        every: n.

    """

    def __init__(self, names: list[str], every: int) -> None:
        self._names, self._every, self._tick = names, every, 0
        places = list(columns())
        self._chosen = [places.index(name) for name in names]
        self._row = np.empty(len(places))
        self._rows: list[Curve] = []

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Keep the present signals, if it is their turn."""
        if self._tick % self._every == 0:
            fill_row(self._row, now_ns, plant, measured)
            self._rows.append(self._row[self._chosen])
        self._tick += 1

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Do nothing."""

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Do nothing."""

    def since(self, begun_ns: int) -> dict[str, Curve]:
        """Return the curves since a time, which is 0 in them."""
        rows = np.array(self._rows).reshape(-1, len(self._names))
        rows[:, 0] -= begun_ns * 1e-9
        kept = rows[rows[:, 0] > -1e-9]
        return {name: kept[:, i].copy() for i, name in enumerate(self._names)}
