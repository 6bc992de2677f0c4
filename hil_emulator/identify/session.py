"""The whole workflow as one function: experiments and a configuration in, a result out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from hil_emulator.cluster import connected
from hil_emulator.config.load import Configuration
from hil_emulator.errors import UserError
from hil_emulator.identify.conclusion import conclude
from hil_emulator.identify.disagreement import account
from hil_emulator.identify.measured import plausible
from hil_emulator.identify.measured.copies import counted
from hil_emulator.identify.measured.experiment import FLOW, Experiment
from hil_emulator.identify.naming.progress import Search
from hil_emulator.identify.naming.search import Searcher
from hil_emulator.identify.prediction import parameters, static
from hil_emulator.identify.prediction.cluster_pool import ClusterPool
from hil_emulator.identify.prediction.flow_bench import PRIORS as FLOW_PRIORS
from hil_emulator.identify.prediction.flow_bench import FlowBench, flow_bench
from hil_emulator.identify.prediction.flow_bench import examinable as flow_examinable
from hil_emulator.identify.prediction.observer import Observer
from hil_emulator.identify.prediction.pool import Pool, Threads
from hil_emulator.identify.prediction.predictor import Predictor
from hil_emulator.identify.prediction.twin import Coordinate, Twin
from hil_emulator.identify.prediction.valve_bench import VOLUME_PRIORS, ValveBench, bench
from hil_emulator.identify.result import Result
from hil_emulator.model.sensors import CHANNELS

DRIVEN = 0.2e-3
"""Least travel of a rod that was moved at all [m] (assumed)."""

SLOWEST = 5e-3
"""Longest sample period that shows a hydraulic mode of some 50 Hz [s]."""

Tell = Callable[[str], None]
Pools = Callable[[Predictor], Pool]


def identify(
    config: Configuration, training: Sequence[Experiment], validation: Sequence[Experiment] = (),
    only: Sequence[str] = (), exclude: Sequence[str] = (), jobs: int = 1,
    tell: Tell = lambda _: None, cache: Path | None = None, search: bool = True, cluster: str = "",
) -> Result:  # fmt: skip
    """Find what a configuration lacks.

    Args:
        config: what should describe the machine.
        training: experiments for the fit.
        validation: experiments for the gate; without any, the last third of the training
            experiments is held out if there are at least three.
        only: effects that may be named; empty for all.
        exclude: effects that may not.
        jobs: threads.
        tell: takes progress in words.
        cache: folder for compiled models.
        search: False measures the gap after refitting ordinary parameters, and names nothing.
        cluster: address of a Dask scheduler, such as "tcp://127.0.0.1:8786", whose workers predict
            in place of the threads, one experiment per task.

    Raises:
        UserError: if an effect is unknown, or the cluster cannot be reached or is lost.

    """
    with _pools(jobs, cluster) as pooled:
        return _identified(
            config, training, validation, only, exclude, pooled, tell, cache, search
        )  # fmt: skip


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
    only: Sequence[str], exclude: Sequence[str], pooled: Pools, tell: Tell, cache: Path | None,
    search: bool,
) -> Result:  # fmt: skip
    twin = Twin(config, cache)
    learn, check = counted(*_split(training, validation))
    notes = [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    predictor, learn, check, why = _predictor(twin, learn, check)
    if predictor is None:
        return Result("cannot_examine", why, notes=notes)
    notes = [f"{e.name}: {note}" for e in (*learn, *check) for note in e.notes]
    twin = predictor.twin
    candidates = _chosen(_candidates(twin, predictor), only, exclude)
    nuisances = parameters.ordinary(twin, _priors(predictor))
    searcher = Searcher(predictor, learn, check, candidates, nuisances, pooled(predictor), tell)
    found = _found(searcher, search)
    if found is None:
        tell("interrupted: concluding from what is known so far")
        return _so_far(searcher, notes, {e.name: e.digest for e in (*learn, *check)})
    result = conclude(searcher, found)
    if not search:
        account.judge(result)
    result.notes = notes
    result.digests = {e.name: e.digest for e in (*learn, *check)}
    hidden = {c.name for c in parameters.candidates(twin, twin.names)}
    result.unseen = sorted(result.unseen + list(hidden - {c.name for c in candidates}))
    if only or exclude:
        barred = hidden - {c.name for c in candidates}
        result.unseen = [name for name in result.unseen if name not in barred]
    return result


def _found(searcher: Searcher, search: bool) -> Search | None:
    """Return a finished search, or None after Ctrl-C, with nothing of it left under way."""
    try:
        return searcher.run() if search else searcher.look()
    except KeyboardInterrupt:
        return None


def _so_far(searcher: Searcher, notes: list[str], digests: dict[str, str]) -> Result:
    """Return the result of a search that the user ended."""
    found = searcher.stopped()
    if not found.rounds:
        why = "interrupted before the first screening of the effects was complete"
        return Result("cannot_examine", why, notes=notes, digests=digests, interrupted=True)
    result = conclude(searcher, found, forecast=False)
    result.reason = f"interrupted; so far {result.reason}"
    result.notes, result.digests, result.interrupted = notes, digests, True
    return result


def _split(
    training: Sequence[Experiment], validation: Sequence[Experiment]
) -> tuple[list[Experiment], list[Experiment]]:
    if validation or len(training) < 3:
        return list(training), list(validation)
    held = max(1, len(training) // 3)
    return list(training[:-held]), list(training[-held:])


def _predictor(
    twin: Twin, learn: list[Experiment], check: list[Experiment]
) -> tuple[Predictor | None, list[Experiment], list[Experiment], str]:
    """Choose what predicts by the channels that are there."""
    everything = [*learn, *check]
    names = tuple(
        c.name for c in CHANNELS
        if not c.differenced and all(c.name in e.readings for e in everything)
    )  # fmt: skip
    travels = [float(np.ptp(x[np.isfinite(x)])) for x in
               (e.readings.get("position", np.zeros(1)) for e in everything)]  # fmt: skip
    if any(FLOW in e.readings for e in everything) and max(travels) < DRIVEN:
        metered, why = flow_bench(twin, everything)
        return metered, learn, check, why
    if max(travels) < DRIVEN:
        valve, why = bench(twin, everything)
        still = "the rod hardly moves; move it by some millimetres" if max(travels) > 0.0 else (
            "no experiment shows a moving position"
        )  # fmt: skip
        why = f"{still}; {why}" if why else _slow(everything)
        return None if why else valve, learn, check, why
    if min(travels) < DRIVEN:
        return None, learn, check, "the rod hardly moves in some; move it by some millimetres"
    contrary = plausible.contradictions(everything, twin)
    if contrary:
        return None, learn, check, "; ".join(contrary)
    if all(len(e.current) for e in everything):
        why = _slow(everything)
        return None if why else Observer(twin, names), learn, check, why
    if "load_force" in names and {"pressure_a", "pressure_b"} & set(names):
        turned = plausible.dissipative(everything, twin)
        return (
            static.StaticObserver(twin), turned[: len(learn)], turned[len(learn) :], ""
        )  # fmt: skip
    why = (
        f"with {', '.join(names)} alone no balance can be examined; add valve_current, or a "
        "chamber pressure and load_force"
    )
    return None, learn, check, why


def _priors(predictor: Predictor) -> Mapping[str, float]:
    """Return how well ordinary parameters are known."""
    if isinstance(predictor, ValveBench):
        return VOLUME_PRIORS
    if isinstance(predictor, FlowBench):
        return FLOW_PRIORS
    return parameters.PRIORS if isinstance(predictor, Observer) else parameters.STATIC_PRIORS


def _slow(experiments: Sequence[Experiment]) -> str:
    """Return why experiments are sampled too slowly, or ""."""
    slowest = max(e.period for e in experiments)
    if slowest <= SLOWEST:
        return ""
    return (
        f"sampled every {slowest * 1e3:.3g} ms: pressures move within that time; record at "
        f"{SLOWEST * 1e3:g} ms or faster"
    )


def _candidates(twin: Twin, predictor: Predictor) -> list[Coordinate]:
    sensors = tuple(c for c in predictor.channels if c in twin.names)
    found = parameters.candidates(twin, sensors)
    if isinstance(predictor, FlowBench):
        return [c for c in found if flow_examinable(c)]
    if isinstance(predictor, Observer):
        return found
    return [c for c in found if static.examinable(c)]


def _chosen(
    candidates: list[Coordinate], only: Sequence[str], exclude: Sequence[str]
) -> list[Coordinate]:
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
