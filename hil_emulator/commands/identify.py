"""`hil-emulator identify` and `gap`: missing effects, and the disagreement with data."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from hil_emulator.api.actuator import ActuatorModel
from hil_emulator.api.identification import (
    LAYER,
    MEASURED,
    OUTPUTS,
    PAGE,
    RESULT,
    TRACES,
    Identification,
    examined,
    findings,
)
from hil_emulator.api.logs import Meaning
from hil_emulator.command_line.group import INTERRUPTED
from hil_emulator.commands.gap_table import gap_lines
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting.headline import headline
from hil_emulator.identify.session import Question
from hil_emulator.platform.allocator import tune_allocator
from hil_emulator.platform.output_files import new_files, refuse_existing, write_texts
from hil_emulator.platform.paths import near
from hil_emulator.units import axis

CONFIGURATIONS = {".toml"}

UNANSWERED = ("cannot_examine", "cannot_tell")
NO_ANSWER = 3
"""Exit code of verdicts without an answer; with an answer it is 0."""

_NO_STATEMENTS = Meaning()


def identify(
    files: Sequence[Path], validate: Sequence[Path], question: Question, out: Path | None,
    jobs: int, meaning: Meaning = _NO_STATEMENTS, cluster: str = "", *, overwrite: bool = False,
) -> None:  # fmt: skip
    """Compare configurations (.toml) with recordings.

    Args:
        files: configurations and recordings, in any order.
        validate: recordings that are not used for the fit.
        question: the task of the search.
        out: folder for the files `OUTPUTS`.
        jobs: threads.
        meaning: statements of the user about the data.
        cluster: address of a Dask scheduler, which replaces threads.
        overwrite: whether files of an earlier result are replaced.

    Raises:
        UserError: for every error of the input.

    """
    configs = [f for f in files if f.suffix in CONFIGURATIONS]
    recordings = [f for f in files if f.suffix not in CONFIGURATIONS]
    if not configs or not recordings:
        raise UserError(
            "name at least one configuration (.toml) and one recording (.csv, .mf4, "
            ".parquet, .blf, ...); what follows --validate is held-out data"
        )
    if out is not None:
        refuse_existing([out / name for name in OUTPUTS], overwrite=overwrite)
    tune_allocator()
    actuator = ActuatorModel(", ".join(f.name for f in configs), load(configs))
    with waiting("identify" if question.search else "gap", [*files, *validate]) as progress:
        answer = examined(
            actuator, recordings, validate, question, lambda text: progress.report(f"  {text}"),
            jobs, meaning, cluster,
        )  # fmt: skip
    with axis(rotary=actuator.config.rotary):
        _report(answer, configs, out, overwrite=overwrite)


def _report(
    answer: Identification, configs: Sequence[Path], out: Path | None, *, overwrite: bool
) -> None:
    """Print the summary, write the files, and set the exit code."""
    actuator, result = answer.actuator, answer.result
    if actuator.config.bench.kind != "actuator":
        click.echo(f"bench     {actuator.config.bench}")
    click.echo(summary(result))
    if out is not None:
        texts = {out / name: text for name, text in findings(result, configs).items()}
        write_texts(texts, overwrite=overwrite)
        click.echo(f"\nwritten   {near(out / RESULT)}, {LAYER}")
        _illustrate(answer, out / PAGE, overwrite=overwrite)
        _keep_traces(result, out / TRACES, overwrite=overwrite)
    if result.interrupted:
        raise SystemExit(INTERRUPTED)
    if result.verdict in UNANSWERED:
        raise SystemExit(NO_ANSWER)


def summary(result: Result) -> str:
    """Return a result for the terminal."""
    lines = [
        f"verdict   {result.verdict}",
        *(f"          {sentence}" for sentence in headline(result)),
    ]
    lines += [f"note      {note}" for note in result.notes]
    lines += [f"held out  {', '.join(result.held_out)}"] if result.held_out else []
    for finding in result.effects:
        lines.append(f"missing   {finding}; takes {finding.share} of the squared error")
        if finding.form_differs:
            lines.append(f"          its law differs from the catalogue's form: {finding.form}")
        lines += [f"          rival {r.name}: {r.lost}" for r in finding.rivals[:3]]
    if result.verdict not in MEASURED:
        lines += [f"unknown   {u.balance} over {u.regressor}: {u.shape}" for u in result.unknown]
        lines += _addition(result)
    lines += _moved(result)
    if result.next_experiment:
        lines.append(f"next      {result.next_experiment}")
    lines += gap_lines(result)
    return "\n".join(lines)


def _moved(result: Result) -> list[str]:
    """Return the ordinary parameters whose estimates are far from the configured values."""
    lines = []
    for name, p in result.parameters.items():
        if p.moved:
            values = f"{p.words(p.refitted)} instead of {p.words(p.configured)}"
            lines.append(f"moved     {p.called(name)}: {p.change:+.0%}, {values}")
    return lines


def _addition(result: Result) -> list[str]:
    """Return the lines on the strongest unexplained term as an effect."""
    if result.verdict != "unknown_effect":
        return []
    if result.added is None:
        return ["          it cannot be added: the model has no place for such a term"]
    return [f"          added to identified.toml as a table, {result.added.name}"]


def _illustrate(result: Identification, file: Path, *, overwrite: bool) -> None:
    """Write the page; an error in it does not lose the findings, which are written already."""
    try:
        page = result.page()
    except Exception as error:
        click.echo(f"no page   report.html failed: {type(error).__name__}: {error}", err=True)
        return
    write_texts({file: page}, overwrite=overwrite)
    click.echo(f"written   {near(file)}")


def _keep_traces(result: Result, file: Path, *, overwrite: bool) -> None:
    """Write the measurement and the residuals of both models for `hil-emulator panel`."""
    parts: dict[str, Any] = {
        f"{name}|{part}": values
        for name, trace in result.traces.items()
        for part, values in trace.items()
    }
    with new_files(overwrite=overwrite) as staged:
        np.savez(staged(file), **parts)
