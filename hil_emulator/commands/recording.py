"""Recording of a run: of one actuator, or of each one of a machine in its own files."""

import copy
import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import click

from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import MachineSettings
from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import HelperFailedError
from hil_emulator.platform.paths import near
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.exports import check_recording
from hil_emulator.recording.header import header
from hil_emulator.recording.header_shape import DIRECTIONS
from hil_emulator.recording.pre_trigger import Capture
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.signals import condition
from hil_emulator.simulation.machine import Machine
from hil_emulator.simulation.rig import Rig


@dataclass(frozen=True)
class RecordOptions:
    """Options of a recording.

    Attributes:
        files: for signals and frames, see `recording.exports`; no recording without any.
        capture: condition around which ticks are recorded; None records all.
        required: whether the run ends when the recording does.
        overwrite: whether existing files are replaced.
        directions: whether candump's log states the direction of each frame.

    """

    files: Sequence[Path] = ()
    capture: Capture | None = None
    required: bool = False
    overwrite: bool = False
    directions: bool = False

    def check(self) -> None:
        """Refuse files that exist or cannot be written.

        Raises:
            UserError: names the file, the reason and the way out.

        """
        if self.files:
            check_recording(self.files, overwrite=self.overwrite)

    def of_actuator(self, name: str) -> "RecordOptions":
        """Return the options for one actuator of several."""
        files = [of_actuator(file, name) for file in self.files]
        return replace(self, files=files, capture=copy.deepcopy(self.capture))


NOT_RECORDED = RecordOptions()


def ordered(
    files: Sequence[Path], required: bool, overwrite: bool, trigger: str | None, before: float,
    after: float, directions: bool = False,
) -> RecordOptions:  # fmt: skip
    """Return the options of the command line.

    Args:
        files: of the recording.
        required: whether the run ends when the recording does.
        overwrite: whether existing files are replaced.
        trigger: condition around which ticks are recorded; without it all are.
        before: time before it [s].
        after: time after it [s].
        directions: whether candump's log states the direction of each frame.

    Raises:
        UserError: for a required recording without a file.

    """
    if required and not files:
        raise UserError("--require-recording: there is no recording; add --record FILE")
    if trigger is None:
        return RecordOptions(files, None, required, overwrite, directions)
    capture = Capture(condition.parse(trigger), round(before * 1e9), round(after * 1e9))
    return RecordOptions(files, capture, required, overwrite, directions)


@contextmanager
def recorded(
    rig: Rig, config: Configuration, options: RecordOptions, supervisor: Supervisor
) -> Iterator[None]:
    """Record the run while the context is open, if there are files.

    Args:
        rig: to record.
        config: of the rig.
        options: of the recording.
        supervisor: watches the writing process; reports its failures at the end.

    """
    files, capture = options.files, options.capture
    if not files:
        yield
        return
    text = capture.text if capture else ""
    head = header(config, rig.nodes, text) | {DIRECTIONS: options.directions}
    recorder = FileRecorder(files, head, capture, overwrite=options.overwrite)
    supervisor.watch(recorder.writer, required=options.required)
    rig.recorder = recorder
    try:
        yield
    finally:
        with suppress(HelperFailedError):  # the supervisor raises it together with other failures
            recorder.close()
            fired = capture is None or capture.triggered_ns is not None
            for file in files if recorder.ticks else ():
                empty = "" if fired else f', without a tick: "{text}" never held'
                click.echo(f"recorded  {near(file)}{empty}")


@contextmanager
def machine_recorded(
    machine: Machine, settings: MachineSettings, options: RecordOptions, supervisor: Supervisor
) -> Iterator[None]:
    """Record every actuator of a machine; a capture depends on the signals of each one."""
    with ExitStack() as stack:
        for actuator in settings.actuators:
            rig = machine.rigs[actuator.name]
            its_own = options.of_actuator(actuator.name)
            stack.enter_context(recorded(rig, actuator.config, its_own, supervisor))
        yield


def check_machine(settings: MachineSettings, options: RecordOptions) -> None:
    """Refuse files of any actuator that exist or cannot be written, or that coincide.

    Raises:
        UserError: names the file, the reason and the way out.

    """
    names = [of_actuator(Path("run.rec"), a.name) for a in settings.actuators]
    if options.files and len(set(names)) < len(names):
        raise UserError("two actuators' names give the same file name; rename one")
    for actuator in settings.actuators:
        options.of_actuator(actuator.name).check()


def of_actuator(file: Path, name: str) -> Path:
    """Return the file of one actuator: `run.rec` of "left knee" is `run_left_knee.rec`."""
    plain = re.sub(r"[^\w-]+", "_", name)
    return file.with_stem(f"{file.stem}_{plain}")
