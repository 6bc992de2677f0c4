"""The whole workflow as one function: from experiments and a configuration to a result."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import get_args

import scipy.linalg  # noqa: F401  only a library that is loaded can be kept to one thread
from threadpoolctl import threadpool_limits

from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.identify.conclusion import account
from hil_emulator.identify.conclusion.conclude import conclude
from hil_emulator.identify.conclusion.record_limits import doubt_haste, doubt_rows
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.data_checks.consistency import without_contradictions
from hil_emulator.identify.data_checks.dither import averaged
from hil_emulator.identify.data_checks.shared_noise import counted
from hil_emulator.identify.estimation.identifiability import identifiable
from hil_emulator.identify.estimation.row_order import ordered
from hil_emulator.identify.estimation.set_point_course import Investigation
from hil_emulator.identify.hold_hypothesis import Report, Searched, course, searched, widen
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.boundary import as_stated, bounded, with_gain
from hil_emulator.identify.prediction.instrumentation import examinable, predicting, tolerances
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.cluster_pool import ClusterPool
from hil_emulator.identify.prediction.parallel.pool import Pool, Threads
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.platform.cluster import connected

Pools = Callable[[Predictor], Pool]


@dataclass(frozen=True)
class Question:
    """Task of an identification.

    Attributes:
        only: effects that may be named; empty for all.
        exclude: effects that may not be named.
        search: False measures the gap after a refit of ordinary parameters, without a search.
        plain_fit: whether to fit the named effects by ordinary least squares, too, for comparison.
        set_points: course of the current between the rows of a log slower than the controller, if
            the user states it.

    Raises:
        UserError: if `set_points` is no such course.

    """

    only: Sequence[str] = ()
    exclude: Sequence[str] = ()
    search: bool = True
    plain_fit: bool = False
    set_points: SetPoints = "unknown"

    def __post_init__(self) -> None:
        """Check the course of the current."""
        if self.set_points not in get_args(SetPoints):
            raise UserError(
                f"set_points: {self.set_points!r} is unknown; "
                f"choose one of {', '.join(get_args(SetPoints))}"
            )


EVERYTHING = Question()
"""A search among all effects of the catalogue."""


def identify(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment] = (),
    question: Question = EVERYTHING, report: Report = lambda _: None, cache: Path | None = None,
    jobs: int = 1, cluster: str = "",
) -> Result:  # fmt: skip
    """Name the effects that a configuration lacks.

    Args:
        config: of the machine.
        training: experiments for the fit.
        validation: experiments for the acceptance test; without any, the last third of the
            training experiments is held out if there are at least three.
        question: task of the search.
        report: receives progress as text.
        cache: folder for compiled models.
        jobs: threads.
        cluster: address of a Dask scheduler, such as "tcp://127.0.0.1:8786". Its workers replace
            the threads and predict one experiment per task.

    Raises:
        UserError: if an effect is unknown, or the cluster cannot be reached or is lost.

    """
    # with such small matrices, threads of the linear algebra only wait for each other
    with threadpool_limits(limits=1, user_api="blas"), _pools(jobs, cluster) as pooled:
        return _identified(config, training, validation, question, pooled, report, cache, jobs)


@contextmanager
def _pools(jobs: int, cluster: str) -> Iterator[Pools]:
    """Yield a function that makes the pool of a predictor."""
    if not cluster:
        yield lambda predictor: Threads(predictor, jobs)
        return
    with connected(cluster) as client:
        yield partial(ClusterPool, client)


def _identified(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment],
    question: Question, pooled: Pools, report: Report, cache: Path | None, jobs: int,
) -> Result:  # fmt: skip
    changes, averages = averaged(config.plant)
    config = replace(config, plant={**config.plant, **changes})
    model = bounded(PlantModel(config, cache), config.bench)
    stated, gain_notes = with_gain(config.bench, training, model.plant_values)
    learn, check = (as_stated(e, stated) for e in counted(training, validation))
    consistent = without_contradictions(learn, check, model.plant_values)
    left_out = averages + gain_notes + consistent.left_out
    learn, check = _split(consistent.training, consistent.validation)
    notes = left_out + [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    predictor, learn, check, why = predicting(model, learn, check, consistent.contrary)
    if predictor is None:
        return Result("cannot_examine", why, notes=notes)
    model = predictor.model
    candidates = _chosen(examinable(model, predictor), question)
    ordinary = parameters.ordinary(model, tolerances(predictor))
    if isinstance(predictor, Observer):
        ordinary += parameters.usual(model)
    nuisances = identifiable(predictor, learn, ordinary, jobs)
    nuisances += [c for c in ordinary if c.field in predictor.later and c not in nuisances]
    given = ordered(predictor, Investigation(learn, check, nuisances, candidates), report, jobs)
    first_choice = course(predictor, given, report, stated=question.set_points, jobs=jobs)
    if first_choice is None:
        return _too_early()
    search = partial(_searched, predictor, pooled=pooled, report=report, thorough=question.search)
    is_stated = question.set_points != "unknown"
    last = searched(predictor, given, first_choice, is_stated, search, report, jobs)
    widened = widen(predictor, last, report, jobs)
    examined, searcher = last.investigation, last.searcher
    learn, check, candidates = examined.learn, examined.check, examined.candidates
    notes = left_out + [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    if last.search is None:
        report("interrupted: concluding from the search so far")
        result = _so_far(searcher)
    else:
        result = conclude(searcher, last.search)
        if not question.search:
            account.judge(result)
        doubt_rows(result, examined.answer, learn, last.held_assumed)
        doubt_haste(result, predictor, [*learn, *check])
        if question.plain_fit and result.gap:
            report("fitting the named effects by ordinary least squares")
            account.compare_with_plain_fit(searcher, last.search, result)
    result.notes = [*notes, *widened, *result.notes]
    result.digests = {e.name: e.digest for e in (*learn, *check)}
    result.held_out = [e.name for e in check]
    every = {c.name for c in parameters.candidates(model, model.names)}
    beyond = set() if question.only or question.exclude else every - {c.name for c in candidates}
    result.unseen = sorted({*result.unseen, *beyond})
    return result


def _searched(
    predictor: Predictor, investigation: Investigation, pooled: Pools, report: Report,
    thorough: bool,
) -> Searched:  # fmt: skip
    """Search for effects, or for free terms only; after Ctrl-C the result holds no search."""
    searcher = Searcher(
        predictor, investigation.learn, investigation.check, investigation.candidates,
        investigation.nuisances, pooled(predictor), report,
    )  # fmt: skip
    try:
        return Searched(investigation, searcher, searcher.run() if thorough else searcher.look())
    except KeyboardInterrupt:
        return Searched(investigation, searcher, None)


def _too_early() -> Result:
    """Return the result of an interruption before the first screening."""
    why = "interrupted before the first screening of the effects was complete"
    return Result("cannot_examine", why, interrupted=True)


def _so_far(searcher: Searcher) -> Result:
    """Return the result of a search that the user interrupted."""
    search = searcher.stopped()
    if not search.rounds:
        return _too_early()
    result = conclude(searcher, search, thorough=False)
    result.reason = f"interrupted; so far {result.reason}"
    result.interrupted = True
    return result


def _split(
    training: Sequence[Experiment], validation: Sequence[Experiment]
) -> tuple[list[Experiment], list[Experiment]]:
    learn, check = _in_order(training), _in_order(validation)
    if check or len(learn) < 3:
        return learn, check
    held = max(1, len(learn) // 3)
    return learn[:-held], learn[-held:]


def _in_order(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Return the logs of a bench sorted by name, so that their order does not change the result.

    Recordings of a complete actuator keep their order, by which the user chooses held-out data.
    """
    if any(len(e.current) for e in experiments):
        return list(experiments)
    return sorted(experiments, key=lambda e: (e.name, e.digest))


def _chosen(candidates: list[Coordinate], question: Question) -> list[Coordinate]:
    only, exclude = question.only, question.exclude
    available = {c.name for c in candidates} | {c.name.rpartition(".")[2] for c in candidates}
    for name in (*only, *exclude):
        if name not in available:
            raise UserError(
                f"{name}: no such effect among those that these data could show; "
                f"they are {', '.join(sorted(c.name for c in candidates))}"
            )

    def named(c: Coordinate, names: Sequence[str]) -> bool:
        return c.name in names or c.name.rpartition(".")[2] in names

    return [c for c in candidates if (not only or named(c, only)) and not named(c, exclude)]
