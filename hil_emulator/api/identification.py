"""`gap` and `identify` from Python, with results that print and draw themselves."""

import json
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from hil_emulator import __version__
from hil_emulator.api.actuator import ActuatorModel
from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.api.picture import Picture
from hil_emulator.api.reading import as_experiments
from hil_emulator.config.load import Configuration, built_in
from hil_emulator.errors import UserError
from hil_emulator.identify import session
from hil_emulator.identify.conclusion.findings import Finding
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.reporting import pictures
from hil_emulator.identify.reporting.headline import headline
from hil_emulator.identify.reporting.layer import EFFECT_FILE, layer
from hil_emulator.identify.reporting.report import report
from hil_emulator.identify.session import Question
from hil_emulator.platform.output_files import FROM_PYTHON, refuse_existing, write_texts
from hil_emulator.platform.paths import cache_folder
from hil_emulator.units import axis

if TYPE_CHECKING:
    import pandas

    Log = str | Path | pandas.DataFrame


RESULT, LAYER, PAGE, TRACES = "result.json", "identified.toml", "report.html", "traces.npz"
OUTPUTS = (RESULT, LAYER, EFFECT_FILE, PAGE, TRACES)
"""Names of all files that `identify` and `gap` write into their folder."""

MEASURED = ("agrees", "disagrees")
"""Verdicts of `gap`, which does not search."""

_NO_STATEMENTS = Meaning()


@dataclass(frozen=True)
class Identification:
    """Result of `gap` or `identify`.

    Attributes:
        actuator: the configured one.
        result: the content of the report and of `result.json`.

    """

    actuator: ActuatorModel
    result: Result

    @property
    def verdict(self) -> str:
        """The outcome in a word: see `hil_emulator.identify.conclusion.result.Verdict`."""
        return self.result.verdict

    @property
    def missing(self) -> dict[str, Finding]:
        """The missing effects by name, in the order of the search."""
        return {finding.name: finding for finding in self.result.effects}

    @property
    def _axis(self) -> AbstractContextManager[None]:
        """Context in which quantities are written in the units of the actuator's axis."""
        return axis(rotary=self.actuator.config.rotary)

    def improved(self) -> ActuatorModel:
        """Return the actuator with the missing effects and the refitted ordinary parameters.

        Raises:
            UserError: if a part of it is a table in a file, which has to be saved first.

        """
        if self.result.added is not None:
            raise UserError("an unknown term was added as a file: save(), then load the folder's")
        with self._axis:
            text = layer(self.result, self.actuator.config.files, today())
        return self.actuator.with_layer(text, LAYER)

    def plot(self) -> Picture:
        """Return a picture of measurement and models where they disagree most.

        Raises:
            UserError: if the data could not be examined.

        """
        if not self.result.traces:
            raise UserError(f"nothing to draw: {self.result.reason}")
        with self._axis:
            return Picture(pictures.trace(self.result, pictures.widest_trace(self.result)))

    def page(self) -> str:
        """Return the report as one HTML page."""
        name = self.actuator.name
        measured = self.verdict in MEASURED
        title = f"{name} compared with measurements" if measured else f"What {name} lacks"
        with self._axis:
            return report(self.result, title, f"hil-emulator {__version__}, {today()}")

    def save(self, folder: str | Path, *, overwrite: bool = False) -> None:
        """Write result.json, identified.toml and report.html into a folder, all or no file.

        Args:
            folder: created if it is missing.
            overwrite: whether files of an earlier result are replaced.

        Raises:
            UserError: if a file exists or cannot be written.

        """
        with self._axis:
            texts = {**findings(self.result, self.actuator.config.files), PAGE: self.page()}
        files = {Path(folder) / name: text for name, text in texts.items()}
        refuse_existing(files, overwrite=overwrite, way_out=FROM_PYTHON)
        write_texts(files, overwrite=overwrite)

    def __repr__(self) -> str:
        with self._axis:
            lines = [self.verdict, *headline(self.result)]
        return "\n".join([*lines, *(f"missing {finding}" for finding in self.result.effects)])

    def _repr_html_(self) -> str:
        with self._axis:
            sentences = "".join(f"<p>{escape(line)}</p>" for line in headline(self.result))
        items = "".join(f"<li>{escape(str(finding))}</li>" for finding in self.result.effects)
        return f"<h4>{escape(self.verdict.replace('_', ' '))}</h4>{sentences}<ul>{items}</ul>"


def gap(
    actuator: ActuatorModel, *logs: "Log", validate: Sequence["Log"] = (), jobs: int = 1,
    set_points: SetPoints = "unknown",
) -> Identification:  # fmt: skip
    """Measure where logs and an actuator's configuration disagree.

    Args:
        actuator: the configured one.
        logs: files in any format of `identify`, or tables, see `reading.as_experiments`.
        validate: held-out logs, which are not used to refit ordinary parameters.
        jobs: threads.
        set_points: course of the current between the rows of a log slower than the controller:
            "held", "moves", or "unknown", which estimates it from the readings.

    Raises:
        UserError: if a log cannot be used.

    """
    question = Question(search=False, set_points=set_points)
    return examined(actuator, logs, validate, question, jobs=jobs)


def identify(
    actuator: ActuatorModel, *logs: "Log", validate: Sequence["Log"] = (), only: Sequence[str] = (),
    exclude: Sequence[str] = (), jobs: int = 1, report: Callable[[str], None] = lambda _: None,
    set_points: SetPoints = "unknown",
) -> Identification:  # fmt: skip
    """Name the physical effects that logs show and the configuration lacks.

    Args:
        actuator: the configured one.
        logs: see `gap`.
        validate: held-out logs, which are not used for the fit.
        only: effects that may be named; by default all.
        exclude: effects that may not be named.
        jobs: threads.
        report: receives progress as text; `print`, for instance.
        set_points: see `gap`.

    Raises:
        UserError: if a log cannot be used, or an effect is unknown.

    """
    question = Question(only, exclude, set_points=set_points)
    return examined(actuator, logs, validate, question, report, jobs)


def findings(result: Result, configs: Sequence[Path]) -> dict[str, str]:
    """Return the results for programs, by the name of the file."""
    texts = {
        RESULT: json.dumps(result.to_dict(), indent=2, ensure_ascii=False),
        LAYER: layer(result, configs, today()),
    }
    return texts if result.added is None else texts | {EFFECT_FILE: result.added.text}


def today() -> str:
    """Return the date, UTC."""
    return datetime.now(tz=UTC).strftime("%Y-%m-%d")


def examined(
    actuator: ActuatorModel, logs: Sequence["Log"], validate: Sequence["Log"], question: Question,
    report: Callable[[str], None] = lambda _: None, jobs: int = 1,
    meaning: Meaning = _NO_STATEMENTS, cluster: str = "",
) -> Identification:  # fmt: skip
    """Compare logs with an actuator; see `gap`, `identify` and `session.identify`.

    Args:
        actuator: the configured one.
        logs: files or tables.
        validate: held-out logs, which are not used for the fit.
        question: task of the search.
        report: receives progress as text.
        jobs: threads.
        meaning: statements about the files.
        cluster: address of a Dask scheduler, which replaces threads.

    Raises:
        UserError: if a log cannot be used, an effect is unknown or the cluster is lost.

    """
    if not logs:
        raise UserError("name at least one log")
    config = built_in(actuator.config)
    with axis(rotary=config.rotary):
        learn, check = (_experiments(some, config, meaning) for some in (logs, validate))
        result = session.identify(
            config, learn, check, question, report, cache_folder(), jobs, cluster
        )
    return Identification(actuator, result)


def _experiments(
    logs: Sequence["Log"], config: Configuration, meaning: Meaning
) -> list[Experiment]:
    """Read files and tables, in their order."""
    made: list[Experiment] = []
    for number, log in enumerate(logs, 1):
        if isinstance(log, str | Path):
            made += experiments([Path(log)], config, meaning)
        else:
            made += as_experiments(log, number)
    return made
