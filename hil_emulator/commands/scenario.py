"""`hil-emulator scenario`: run scenarios, print the results, write reports."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import waiting
from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import new_files, refuse_existing
from hil_emulator.platform.paths import near
from hil_emulator.scenario import report
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.schema import Role
from hil_emulator.scenario.spread import run_all


@dataclass(frozen=True)
class Reports:
    """Files that report outcomes.

    Attributes:
        junit: for JUnit XML; None without.
        page: for one HTML page; None without.
        overwrite: whether existing files are replaced.

    """

    junit: Path | None = None
    page: Path | None = None
    overwrite: bool = False

    def check(self) -> None:
        """Refuse files that exist.

        Raises:
            UserError: names the file and the way out.

        """
        refuse_existing(filter(None, (self.junit, self.page)), overwrite=self.overwrite)

    def write(self, outcomes: Sequence[Outcome]) -> None:
        """Write the files.

        Raises:
            UserError: if a file cannot be written.

        """
        for file, write in ((self.junit, report.junit), (self.page, report.page)):
            if file is not None:
                with new_files(overwrite=self.overwrite) as staged:
                    write(outcomes, staged(file))
                click.echo(f"report: {near(file)}")


def scenario(
    files: Sequence[Path],
    workers: int,
    cluster: str,
    reports: Reports,
    recordings: Path | None = None,
    role: Role | None = None,
) -> int:
    """Run scenarios.

    Args:
        files: of the scenarios.
        workers: number of processes.
        cluster: address of a Dask scheduler, which replaces them; "" without.
        reports: files to write in the end.
        recordings: folder for recordings; None without.
        role: which controller acts, in place of that of each file.

    Returns:
        0 if all have passed, 1 if an expectation is not met, 2 if one could not run.

    Raises:
        UserError: if the cluster cannot be reached or a file exists or cannot be
            written.

    """
    reports.check()
    with waiting("scenario", files):
        outcomes = run_all(
            files, workers, cluster, recordings, role=role, overwrite=reports.overwrite
        )
    if recordings is not None:
        click.echo(f"recorded: {near(recordings)}")
    return conclude(outcomes, reports)


def conclude(outcomes: Sequence[Outcome], reports: Reports) -> int:
    """Print and report outcomes; return the exit code."""
    header = ("verdict", "scenario", "met", "took", "digest")
    click.echo(text_table(header, report.rows(outcomes)))
    for line in report.failures(outcomes):
        click.echo(line)
    reports.write(outcomes)
    if any(o.error for o in outcomes):
        return UserError.exit_code
    return 0 if all(o.passed for o in outcomes) else 1
