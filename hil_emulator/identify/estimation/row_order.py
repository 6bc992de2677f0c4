"""Test whether the current in a log's row acted before the readings of that row or after them.

Logs do not state it. A shift by one row looks like a much faster valve, and no missing effect makes
a current act earlier than it was logged.
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

ROUNDS = 8
"""Iterations of a fit. With friction 2.5 times its configured value, 3 iterations prefer the wrong
row, and 5 the right one."""

GAIN_PER_SAMPLE = 0.1
"""Smallest gain in chi-square per sample for a shift (assumed): for the reference machine, a wrong
row of 1 ms costs at least 0.18; shifting a correct one gains nothing."""


def ordered(
    predictor: Predictor, given: Investigation, report: Callable[[str], None], jobs: int = 1
) -> Investigation:
    """Return the investigation with each current one row earlier if the fit is much better.

    Args:
        predictor: computes innovations.
        given: the data with the recorded current.
        report: receives progress as text.
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
    note = (
        "valve_current: assumed to act before the readings of its row, which explains them much "
        f"better (chi-square {earlier:.3g} instead of {kept:.3g}); --current-acts states it"
    )
    learn, check = (
        [replace(_earlier(e), notes=(*e.notes, note)) if e.order_assumed else e for e in part]
        for part in (given.learn, given.check)
    )
    return replace(given, learn=learn, check=check)


def _earlier(e: Experiment) -> Experiment:
    current = np.append(e.current[1:], e.current[-1:])
    return replace(e, current=current, set_point_first=True, order_assumed=False)


def _course(e: Experiment) -> Experiment:
    return moving(e) if slower_than_controller(e) else e


def _courses(experiments: Sequence[Experiment]) -> list[list[Experiment]]:
    """Return the experiments with a held current and, for slow logs, with a moving one."""
    held = list(experiments)
    slow = any(map(slower_than_controller, held))
    return [held, [_course(e) for e in held]] if slow else [held]


def _chi2(
    fitter: Fitter, frozen: Sequence[Frozen], experiments: Sequence[Experiment],
    free: Sequence[Coordinate],
) -> float:  # fmt: skip
    """Return the smallest chi-square with other currents, for the same gains and weights."""
    changed = [_with(f, e) for f, e in zip(frozen, experiments, strict=True)]
    batch = LocalBatch(fitter.predictor, changed, fitter.jobs)
    return fitter.with_batch(batch).fit(free, np.zeros(len(free)), ROUNDS).chi2


def _with(frozen: Frozen, e: Experiment) -> Frozen:
    """Return a frozen experiment with the current of another one."""
    parts = frozen.data.current.shape[1]
    current = e.currents.current
    current = np.repeat(current, parts // current.shape[1], axis=1)
    return replace(frozen, data=frozen.data._replace(current=current))
