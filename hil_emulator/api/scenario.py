"""Scenarios with a controller in Python."""

from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.scenario.loading import runs_of
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.perform import Connect, perform


def play(file: str | Path, connect: Connect | None = None) -> list[Outcome]:
    """Play a scenario in lock-step and return the outcome of each run.

    Args:
        file: of the scenario.
        connect: called with the emulator before the first tick of a run, to connect your
            controller: `rig.every_tick(controller.step)` calls it after each tick, and
            `can.Bus(**rig.bus)` joins the bus. If it returns a function, this is called at the
            end of the run. Without `connect` the controller of the file acts.

    Raises:
        UserError: if the scenario cannot run.

    """
    path = Path(file).resolve()
    outcomes = [perform(path, run=run, connect=connect) for run in range(len(runs_of(path)))]
    for outcome in outcomes:
        if outcome.error:
            raise UserError(f"{outcome.title}: {outcome.error}")
    return outcomes
