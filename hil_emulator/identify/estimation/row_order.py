"""Whether the current of a log's row acted before its readings or acts from them on.

A table does not state it, and one row of shift looks like a much faster valve: nothing that is
missing from a model makes a current act earlier than it was logged.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.set_point_course import Investigation
from hil_emulator.identify.measured.between_rows import moving, slower_than_controller
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import LocalBatch, Threads
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

ROUNDS = 3
"""Iterations of a fit, enough to tell a row of shift (assumed)."""

GAIN_PER_SAMPLE = 0.1
"""Least gain in chi-square over the number of samples (assumed): a wrong row of 1 ms costs the
reference machine 0.18 and more, a right one that is shifted gains nothing."""


def ordered(
    predictor: Predictor, given: Investigation, report: Callable[[str], None], jobs: int = 1
) -> Investigation:
    """Return the same with each current a row earlier, if that explains the readings better.

    Args:
        predictor: computes innovations.
        given: what is examined, the current as it was recorded.
        tell: takes progress in words.
        jobs: threads.

    """
    unstated = [e for e in given.learn if e.order_assumed and len(e.current)]
    if not unstated or not isinstance(predictor, Observer):
        return given
    report("comparing the current with the readings of its row and of the next one")
    fitter = Fitter(predictor, [_course(e) for e in unstated], Threads(predictor, jobs))
    fitter.freeze(given.nuisances, np.zeros(len(given.nuisances)))
    frozen = [f for f in fitter.frozen if isinstance(f, Frozen)]
    kept, earlier = (
        min(_chi2(fitter, frozen, course, given.nuisances) for course in _courses(experiments))
        for experiments in (unstated, [_earlier(e) for e in unstated])
    )
    if kept - earlier < GAIN_PER_SAMPLE * sum(e.samples for e in unstated):
        return given
    said = (
        "valve_current: taken to have acted before the readings of its row, which explains them "
        f"much better (chi-square {earlier:.3g} in place of {kept:.3g}); --current-acts states it"
    )
    learn, check = (
        [replace(_earlier(e), notes=(*e.notes, said)) if e.order_assumed else e for e in part]
        for part in (given.learn, given.check)
    )
    return replace(given, learn=learn, check=check)


def _earlier(e: Experiment) -> Experiment:
    current = np.append(e.current[1:], e.current[-1:])
    return replace(e, current=current, set_point_first=True, order_assumed=False)


def _course(e: Experiment) -> Experiment:
    return moving(e) if slower_than_controller(e) else e


def _courses(experiments: Sequence[Experiment]) -> list[list[Experiment]]:
    """Return the experiments with a current that is held, and with one that moves if it may."""
    held = list(experiments)
    slow = any(map(slower_than_controller, held))
    return [held, [_course(e) for e in held]] if slow else [held]


def _chi2(
    fitter: Fitter, frozen: Sequence[Frozen], experiments: Sequence[Experiment],
    free: Sequence[Coordinate],
) -> float:  # fmt: skip
    """Return the least chi-square with other currents, the gains and weights as they are."""
    seen = [_with(f, e) for f, e in zip(frozen, experiments, strict=True)]
    batch = LocalBatch(fitter.predictor, seen, fitter.jobs)
    return fitter.seeing(batch).fit(free, np.zeros(len(free)), ROUNDS).chi2


def _with(frozen: Frozen, e: Experiment) -> Frozen:
    """Return a frozen experiment with the current of another one."""
    parts = frozen.data.current.shape[1]
    current = e.currents.current
    current = np.repeat(current, parts // current.shape[1], axis=1)
    return replace(frozen, data=frozen.data._replace(current=current))
