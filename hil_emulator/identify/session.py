"""The whole workflow as one function: experiments and a configuration in, a result out."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
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
from hil_emulator.identify.data_checks.shared_noise import counted
from hil_emulator.identify.estimation.felt import felt
from hil_emulator.identify.estimation.row_order import ordered
from hil_emulator.identify.estimation.set_point_course import Investigation
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.boundary import as_stated, bounded, with_gain
from hil_emulator.identify.prediction.instrumentation import examinable, predicting, tolerances
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.cluster_pool import ClusterPool
from hil_emulator.identify.prediction.parallel.pool import Pool, Threads
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.second_search import Searched, Tell, course, searched, widen
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.platform.cluster import connected

Pools = Callable[[Predictor], Pool]


@dataclass(frozen=True)
class Question:
    """What is asked of the data.

    Attributes:
        only: effects that may be named; empty for all.
        exclude: effects that may not.
        search: False measures the gap after refitting ordinary parameters, and names nothing.
        plain_fit: whether to fit what is named by ordinary least squares, too, for comparison.
        set_points: what the current did between the rows of a log slower than the controller, if
            that is known.

    Raises:
        UserError: if it is said to have done anything else.

    """

    only: Sequence[str] = ()
    exclude: Sequence[str] = ()
    search: bool = True
    plain_fit: bool = False
    set_points: SetPoints = "unknown"

    def __post_init__(self) -> None:
        """Refuse what nobody would understand later on."""
        if self.set_points not in get_args(SetPoints):
            raise UserError(
                f"set_points: {self.set_points!r} is none of {', '.join(get_args(SetPoints))}"
            )


EVERYTHING = Question()
"""Which effects of the whole catalogue the configuration lacks."""


def identify(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment] = (),
    question: Question = EVERYTHING, tell: Tell = lambda _: None, cache: Path | None = None,
    jobs: int = 1, cluster: str = "",
) -> Result:  # fmt: skip
    """Find what a configuration lacks.

    Args:
        config: what should describe the machine.
        training: experiments for the fit.
        validation: experiments for the acceptance test; without any, the last third of the
            training experiments is held out if there are at least three.
        question: what to look for.
        tell: takes progress in words.
        cache: folder for compiled models.
        jobs: threads.
        cluster: address of a Dask scheduler, such as "tcp://127.0.0.1:8786", whose workers predict
            in place of the threads, one experiment per task.

    Raises:
        UserError: if an effect is unknown, or the cluster cannot be reached or is lost.

    """
    # of matrices as small as these, threads of the linear algebra wait for each other
    with threadpool_limits(limits=1, user_api="blas"), _pools(jobs, cluster) as pooled:
        return _identified(config, training, validation, question, pooled, tell, cache, jobs)


@contextmanager
def _pools(jobs: int, cluster: str) -> Iterator[Pools]:
    """Yield what makes a pool for a predictor."""
    if not cluster:
        yield lambda predictor: Threads(predictor, jobs)
        return
    with connected(cluster) as client:
        yield partial(ClusterPool, client)


def _identified(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment],
    question: Question, pooled: Pools, tell: Tell, cache: Path | None, jobs: int,
) -> Result:  # fmt: skip
    model = bounded(PlantModel(config, cache), config.bench)
    stated, said = with_gain(config.bench, training, model.plant_values)
    learn, check = (as_stated(e, stated) for e in counted(training, validation))
    sound = without_contradictions(learn, check, model.plant_values)
    left_out = said + sound.left_out
    learn, check = _split(sound.training, sound.validation)
    notes = left_out + [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    predictor, learn, check, why = predicting(model, learn, check, sound.contrary)
    if predictor is None:
        return Result("cannot_examine", why, notes=notes)
    model = predictor.model
    candidates = _chosen(examinable(model, predictor), question)
    ordinary = parameters.ordinary(model, tolerances(predictor))
    nuisances = felt(predictor, learn, ordinary, jobs)
    nuisances += [c for c in ordinary if c.field in predictor.later and c not in nuisances]
    given = ordered(predictor, Investigation(learn, check, nuisances, candidates), tell, jobs)
    asked = course(predictor, given, tell, told=question.set_points, jobs=jobs)
    if asked is None:
        return _too_early()
    search = partial(_searched, predictor, pooled=pooled, tell=tell, thorough=question.search)
    told = question.set_points != "unknown"
    last = searched(predictor, given, asked, told, search, tell, jobs)
    widened = widen(predictor, last, tell, jobs)
    asked, searcher, found = last.asked, last.searcher, last.found
    learn, check, candidates = asked.learn, asked.check, asked.candidates
    notes = left_out + [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    if found is None:
        tell("interrupted: concluding from what is known so far")
        result = _so_far(searcher)
    else:
        result = conclude(searcher, found)
        if not question.search:
            account.judge(result)
        doubt_rows(result, asked.answer, learn, last.believed)
        doubt_haste(result, predictor, [*learn, *check])
        if question.plain_fit and result.gap:
            tell("fitting the same by ordinary least squares")
            account.compare_with_plain_fit(searcher, found, result)
    result.notes = [*notes, *widened, *result.notes]
    result.digests = {e.name: e.digest for e in (*learn, *check)}
    result.held_out = [e.name for e in check]
    every = {c.name for c in parameters.candidates(model, model.names)}
    beyond = set() if question.only or question.exclude else every - {c.name for c in candidates}
    result.unseen = sorted({*result.unseen, *beyond})
    return result


def _searched(
    predictor: Predictor, asked: Investigation, pooled: Pools, tell: Tell, thorough: bool
) -> Searched:  # fmt: skip
    """Search, or look for terms alone; after Ctrl-C nothing is found, with nothing under way."""
    searcher = Searcher(
        predictor, asked.learn, asked.check, asked.candidates, asked.nuisances, pooled(predictor),
        tell,
    )  # fmt: skip
    try:
        return Searched(asked, searcher, searcher.run() if thorough else searcher.look())
    except KeyboardInterrupt:
        return Searched(asked, searcher, None)


def _too_early() -> Result:
    """Return that nothing is known so far."""
    why = "interrupted before the first screening of the effects was complete"
    return Result("cannot_examine", why, interrupted=True)


def _so_far(searcher: Searcher) -> Result:
    """Return the result of a search that the user ended."""
    found = searcher.stopped()
    if not found.rounds:
        return _too_early()
    result = conclude(searcher, found, thorough=False)
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
    """Return the logs of a bench in the order of their names: any order gives the same answer.

    Recordings of a whole actuator stay as they are: who numbers them has chosen what is held out.
    """
    if any(len(e.current) for e in experiments):
        return list(experiments)
    return sorted(experiments, key=lambda e: (e.name, e.digest))


def _chosen(candidates: list[Coordinate], question: Question) -> list[Coordinate]:
    only, exclude = question.only, question.exclude
    known = {c.name for c in candidates} | {c.name.rpartition(".")[2] for c in candidates}
    for name in (*only, *exclude):
        if name not in known:
            raise UserError(
                f"{name}: no such effect among those that these data could show; "
                f"they are {', '.join(sorted(c.name for c in candidates))}"
            )

    def named(c: Coordinate, names: Sequence[str]) -> bool:
        return c.name in names or c.name.rpartition(".")[2] in names

    return [c for c in candidates if (not only or named(c, only)) and not named(c, exclude)]
