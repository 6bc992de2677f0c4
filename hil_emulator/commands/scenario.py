"""`hil-emulator scenario`: run scenarios, print the results, write reports."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import waiting
from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import new_files, refuse_existing
from hil_emulator.platform.paths import near
from hil_emulator.scenario import report
from hil_emulator.scenario.spread import run_all


def scenario(
    files: Sequence[Path],
    workers: int,
    cluster: str,
    junit: Path | None,
    page: Path | None,
    recordings: Path | None = None,
    *,
    overwrite: bool = False,
) -> int:
    """Run scenarios.

    Returns:
        0 if all have passed, 1 if an expectation is not met, 2 if one could not run.

    Raises:
        UserError: if the cluster cannot be reached or a file exists or cannot be
            written.

    """
    refuse_existing(filter(None, (junit, page)), overwrite=overwrite)
    with waiting("scenario", files):
        outcomes = run_all(files, workers, cluster, recordings, overwrite=overwrite)
    header = ("verdict", "scenario", "met", "took", "digest")
    click.echo(text_table(header, report.rows(outcomes)))
    for line in report.failures(outcomes):
        click.echo(line)
    if recordings is not None:
        click.echo(f"recorded: {near(recordings)}")
    for file, write in ((junit, report.junit), (page, report.page)):
        if file is not None:
            with new_files(overwrite=overwrite) as staged:
                write(outcomes, staged(file))
            click.echo(f"report: {near(file)}")
    if any(o.error for o in outcomes):
        return UserError.exit_code
    return 0 if all(o.passed for o in outcomes) else 1
