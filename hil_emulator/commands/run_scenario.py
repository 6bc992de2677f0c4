"""`hil-emulator run --scenario`: the runs of a scenario on one live bus, and their reports."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.commands.live_play import LivePlay, ScenarioOver
from hil_emulator.commands.recording import RecordOptions
from hil_emulator.commands.scenario import Reports, conclude
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.scenario.loading import runs_of
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.perform import seeded
from hil_emulator.scenario.schema import Role, Scenario


@dataclass(frozen=True)
class ScenarioOptions:
    """Options of a scenario that is played on a live bus.

    Attributes:
        file: the scenario.
        role: which controller acts, in place of that of the file.
        reports: files to write in the end.

    """

    file: Path
    role: Role | None
    reports: Reports

    def runs(self, files: Sequence[Path]) -> list[Scenario]:
        """Return the runs.

        Args:
            files: of the configuration; without any, those of the scenario.

        Raises:
            UserError: for mistakes of the file, or reports that exist.

        """
        self.reports.check()
        return runs_of(self.file.resolve(), files)

    def configuration(self, files: Sequence[Path]) -> Sequence[Path]:
        """Return the configuration files: those of the command line, else of the scenario.

        Raises:
            UserError: if the runs of the scenario have several.

        """
        names = [run.config for run in runs_of(self.file, files)]
        if not files and names.count(names[0]) < len(names):
            raise UserError(f"{self.file}: one bus has one machine, but config differs by run")
        return files or [self.file.parent / name for name in names[0]]


def scenario_options(
    played: Path | None, role: Role | None, junit: Path | None, page: Path | None, *,
    overwrite: bool,
) -> ScenarioOptions | None:  # fmt: skip
    """Return the options of a scenario on the command line; None without one.

    Raises:
        UserError: for options that need a scenario.

    """
    if played is not None:
        return ScenarioOptions(played, role, Reports(junit, page, overwrite))
    if role or junit or page:
        raise UserError("--controller, --junit and --html need a scenario; add --scenario FILE")
    return None


def play_runs(
    options: ScenarioOptions, runs: Sequence[Scenario], config: Configuration,
    recording: RecordOptions, run: Callable[[LivePlay, Configuration, RecordOptions], None],
) -> int:  # fmt: skip
    """Play all runs on one bus, report, and return the exit code.

    Args:
        options: of the scenario.
        runs: of the scenario.
        config: of the rig.
        recording: options of the recording; of several runs each has its own files.
        run: runs the rig of a configuration until the play ends it.

    Raises:
        UserError: if a recording exists, or the rig cannot play the scenario.

    """
    outcomes: list[Outcome] = []
    numbers = [str(number) for number in range(1, len(runs) + 1)]
    recordings = [recording.of_actuator(n) for n in numbers] if len(runs) > 1 else [recording]
    for kept in recordings:
        kept.check()
    for scenario, kept in zip(runs, recordings, strict=True):
        play = LivePlay(options.file.resolve(), scenario, options.role or scenario.controller)
        error, interrupted = "", False
        try:
            run(play, seeded(config, scenario), kept)
            interrupted = True
        except ScenarioOver:
            pass
        except UserError as mistake:
            if not play.started:
                raise
            error = str(mistake)
        outcomes.append(play.outcome(error))
        if interrupted:
            break
    return conclude(outcomes, options.reports)
