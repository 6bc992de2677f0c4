"""Recording a run: of one actuator, or of each one of a machine in files of its own."""

import copy
import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import click

from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import MachineSettings
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import near
from hil_emulator.recording.header import header
from hil_emulator.recording.pre_trigger import Capture
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.simulation.machine import Machine
from hil_emulator.simulation.rig import Rig


@contextmanager
def recorded(
    rig: Rig, config: Configuration, files: Sequence[Path], capture: Capture | None
) -> Iterator[None]:
    """Record what happens meanwhile, where there are files to record into."""
    if not files:
        yield
        return
    text = capture.text if capture else ""
    recorder = FileRecorder(files, header(config, rig.nodes, text), capture)
    rig.recorder = recorder
    try:
        yield
    finally:
        recorder.close()
        fired = capture is None or capture.triggered_ns is not None
        for file in files:
            empty = "" if fired else f', without a tick: "{text}" never held'
            click.echo(f"recorded  {near(file)}{empty}")


@contextmanager
def machine_recorded(
    machine: Machine, settings: MachineSettings, files: Sequence[Path], capture: Capture | None
) -> Iterator[None]:
    """Record every actuator of a machine; a capture waits for the signals of each by itself."""
    with ExitStack() as stack:
        for actuator in settings.actuators:
            own = [of_actuator(file, actuator.name) for file in files]
            rig = machine.rigs[actuator.name]
            stack.enter_context(recorded(rig, actuator.config, own, copy.deepcopy(capture)))
        yield


def refuse_one_file_for_two(settings: MachineSettings, files: Sequence[Path]) -> None:
    """Make sure that no two actuators would be recorded in the same file.

    Raises:
        UserError: if two would.

    """
    names = [of_actuator(Path("run.rec"), a.name) for a in settings.actuators]
    if files and len(set(names)) < len(names):
        raise UserError("two actuators have names too alike for files of their own; rename one")


def of_actuator(file: Path, name: str) -> Path:
    """Return the file of one actuator: `run.rec` of "left knee" is `run_left_knee.rec`."""
    plain = re.sub(r"[^\w-]+", "_", name)
    return file.with_stem(f"{file.stem}_{plain}")
