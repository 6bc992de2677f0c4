"""Run of one scenario in lock-step, on an emulator of its own."""

import dataclasses
import hashlib
import time
from collections.abc import Callable
from pathlib import Path

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import Configuration, load_rig
from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import new_files
from hil_emulator.recording import SUFFIX, exports, journal
from hil_emulator.recording.several import Recorders
from hil_emulator.scenario import loading
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.performance import Performance
from hil_emulator.scenario.schema import Role, Scenario
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.simulation.not_finite import PlantFailedError
from hil_emulator.units import axis

Connect = Callable[[Emulator], Callable[[], object] | None]
"""Connects a controller in Python before the first tick; the result is called in the end."""


def rig_of(scenario: Scenario, folder: Path) -> Configuration:
    """Return the rig for a scenario of a folder, with the scenario's own seed."""
    config = load_rig([folder / name for name in scenario.config])
    return seeded(config, scenario)


def seeded(config: Configuration, scenario: Scenario) -> Configuration:
    """Return a configuration with the scenario's own seed."""
    return config if scenario.seed is None else dataclasses.replace(config, seed=scenario.seed)


def recordings_of(file: Path, folder: Path, run: int = 0) -> tuple[Path, Path]:
    """Return the files of the recording of a run: the journal and a table."""
    stem = f"{file.stem}_{run + 1}" if run else file.stem
    return folder / f"{stem}{SUFFIX}", folder / f"{stem}.csv"


def perform(
    file: Path, recordings: Path | None = None, *, run: int = 0, role: Role | None = None,
    connect: Connect | None = None, overwrite: bool = False,
) -> Outcome:  # fmt: skip
    """Run a scenario; an error of the input is an outcome too.

    Args:
        file: the scenario.
        recordings: folder for its recording, see `recordings_of`; without it nothing is written.
        run: number of the run, of those that sweep and repetition make.
        role: which controller acts; by default that of the file, or `external` with `connect`.
        connect: connects a controller in Python.
        overwrite: whether an existing recording is replaced.

    """
    try:
        scenario = loading.runs_of(file)[run]
        config = rig_of(scenario, file.parent)
        with axis(rotary=config.rotary), Emulator(config) as emulator:
            files = recordings_of(file, recordings, run) if recordings else None
            chosen = role or ("external" if connect else scenario.controller)
            return _played(file, scenario, emulator, chosen, connect, files, overwrite=overwrite)
    except UserError as error:
        return Outcome(str(file), file.stem, error=str(error))


def _played(
    file: Path, scenario: Scenario, emulator: Emulator, role: Role, connect: Connect | None,
    recordings: tuple[Path, Path] | None, *, overwrite: bool,
) -> Outcome:  # fmt: skip
    if role == "external" and connect is None:
        raise UserError(_EXTERNAL.format(file=file.name))
    began = time.perf_counter()
    with Bus(emulator.bus) as port:
        performance = Performance(file, scenario, emulator.rig, port, role)
        emulator.rig.recorder = Recorders(emulator.recorder, *performance.recorders)
        leave = connect(emulator) if connect else None
        try:
            while not performance.conductor.over:
                performance.conductor.before()
                emulator.tick()
                performance.conductor.after()
        finally:
            if leave:
                leave()
    if recordings is not None:
        _keep(emulator, recordings, overwrite=overwrite)
    # the last signals before the failure may meet every expectation
    if emulator.rig.plant.supply.failure:
        raise PlantFailedError(emulator.rig.plant.supply.failure)
    digest = hashlib.sha256(repr(emulator.recorder.frames).encode())
    digest.update(emulator.recorder.rows().tobytes())
    outcome = performance.outcome(time.perf_counter() - began)
    return dataclasses.replace(outcome, digest=digest.hexdigest()[:16])


_EXTERNAL = (
    "it is for an external controller: `hil-emulator run --scenario {file}` plays it on a bus, "
    '`hil.play("{file}", connect)` with a controller in Python, and `hil-emulator scenario '
    "{file} --controller reference` with the package's own"
)


def _keep(emulator: Emulator, files: tuple[Path, Path], *, overwrite: bool) -> None:
    """Write the recording.

    Raises:
        UserError: if a file exists or cannot be written.

    """
    with new_files(overwrite=overwrite) as staged:
        whole, table = map(staged, files)
        journal.write(emulator.recording(), whole)
        exports.write(whole, table)
