"""Test whether the current was held between the rows of a slow log, or changed in between.

The response of the machine decides, since a changing current moves the spool. Both hypotheses are
fitted with the same gains, each with its own ordinary parameters and dead time: a held current acts
late by half a period on average.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.between_rows import (
    CONTROLLER,
    SetPoints,
    moving,
    slower_than_controller,
)
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import LocalBatch, Threads
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import candidates

DEAD_TIME = "transport_delay"
"""Effect that delays the current."""

ROUNDS = 5
"""Iterations per Jacobian, which is updated in between (assumed)."""

PASSES = 10
"""Largest number of Jacobians of a fit. The loss has a flat valley along valve bandwidth and dead
time; fits that stopped too early gave the wrong course for two of twelve healthy axes."""

SETTLED = 1.0
"""Gain in chi-square per Jacobian below which a fit ends; far below a significant difference."""


@dataclass(frozen=True)
class Investigation:
    """Data and candidates of a search, and the course of the current between rows.

    Attributes:
        learn: experiments for the fit, with a curve through the current if it moves.
        check: the same for the acceptance test.
        nuisances: ordinary parameters, with a dead time if it is not separable from a hold.
        candidates: effects that may be named.
        answer: course of the current between the rows of logs slower than the controller.

    """

    learn: list[Experiment]
    check: list[Experiment]
    nuisances: list[Coordinate]
    candidates: list[Coordinate]
    answer: SetPoints = "held"


def followed(
    predictor: Predictor, given: Investigation, threshold: float,
    report: Callable[[str], None] = lambda _: None, model: Fit | None = None,
    stated: SetPoints = "unknown", jobs: int = 1,
) -> Investigation:  # fmt: skip
    """Determine the course of the current between rows, and note it with the experiments.

    Args:
        predictor: computes innovations.
        given: the data with the recorded current.
        threshold: difference in chi-square from which one course is accepted.
        report: receives progress as text.
        model: fit with the named effects; None for the configured model. A missing effect may look
            like either course.
        stated: course that the user states; it is not tested.
        jobs: threads.

    """
    slow = [e for e in given.learn if len(e.current) and slower_than_controller(e)]
    if not slow or not isinstance(predictor, Observer):
        return given if stated == "unknown" else _needless(given)
    if stated != "unknown":
        return _with(given, stated, ", as stated")
    report("testing whether the current changed between the rows")
    dead_time = [c for c in candidates(predictor.model, ()) if c.name == DEAD_TIME]
    fitter = Fitter(predictor, [moving(e) for e in slow], Threads(predictor, jobs))
    fitted = given.nuisances if model is None else model.coordinates
    free = [*(c for c in fitted if c.name != DEAD_TIME), *dead_time]
    values = {} if model is None else {c.name: a for c, a in zip(fitted, model.at, strict=True)}
    answer = _answer(fitter, free, np.array([values.get(c.name, 0.0) for c in free]), threshold)
    noted = _with(given, answer, "" if answer == "unknown" else ", as the readings show")
    if answer != "unknown":
        return noted
    period = max(e.period for e in slow)
    dead_time = [replace(c, prior=period / c.scale) for c in dead_time]
    rest = [c for c in given.candidates if c.name != DEAD_TIME]
    return replace(noted, nuisances=[*given.nuisances, *dead_time], candidates=rest)


def hold(experiments: Sequence[Experiment]) -> float:
    """Return the mean delay of a held current [s]: half of the log's less the controller's period.

    The delay is relative to a current that changes with the controller's period.
    """
    return 0.5 * (max(e.period for e in experiments) - CONTROLLER)


def held(given: Investigation, why: str) -> Investigation:
    """Return the data with the current assumed to be held, with the reason as a note."""
    return _with(given, "held", f", since {why}")


def late(given: Investigation) -> Investigation:
    """Return the data with an undetermined course, and a note that a dead time acts as well."""
    return _with(given, "unknown", "; it acts later than a held current")


def shifts(
    predictor: Predictor, experiments: Sequence[Experiment], fit: Fit, jobs: int = 1
) -> dict[str, float]:
    """Return the change of each coordinate of a model if the current was held between rows.

    A dead time as an ordinary parameter is then removed; a named one stays.

    Args:
        predictor: computes innovations.
        experiments: for the fit, with a moving current.
        fit: of the model with these data.
        jobs: threads.

    """
    kept = [i for i, c in enumerate(fit.coordinates)
            if c.name != DEAD_TIME or not np.isfinite(c.prior)]  # fmt: skip
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    fitter = Fitter(predictor, experiments, Threads(predictor, jobs))
    fitter.freeze(free, at)
    fitter.batch = _with_held_current(fitter)
    refitted = _iterated(fitter, free, at)
    return {c.name: float(after - before)
            for c, after, before in zip(free, refitted.at, at, strict=True)}  # fmt: skip


_COURSES: dict[SetPoints, str] = {
    "held": "held from row to row",
    "moves": "it changes between the rows",
    "unknown": "the readings do not show whether it changes between the rows or acts late",
}
"""Course of the current in notes."""


def _needless(given: Investigation) -> Investigation:
    """Return the data with a note that the stated course has no effect."""
    note = "valve_current: --set-points has no effect on data like these"
    learn, check = ([replace(e, notes=(*e.notes, note)) for e in part]
                    for part in (given.learn, given.check))  # fmt: skip
    return replace(given, learn=learn, check=check)


def _with(given: Investigation, answer: SetPoints, reason: str) -> Investigation:
    """Return the data with a course of the current, and a note with the reason."""
    note = f"valve_current: {_COURSES[answer]}{reason}"
    learn, check = ([_as(answer, e, note) for e in part] for part in (given.learn, given.check))
    return replace(given, learn=learn, check=check, answer=answer)


def _as(answer: SetPoints, e: Experiment, note: str) -> Experiment:
    """Return an experiment with a course of its current, and a note."""
    if not slower_than_controller(e):
        return e
    if answer == "held":
        return replace(e, notes=(*e.notes, note))
    curve = f"assumed: a curve through the rows, in steps of {CONTROLLER * 1e3:g} ms"
    return moving(replace(e, notes=(*e.notes, f"{note}; {curve}")))


def _answer(fitter: Fitter, free: list[Coordinate], at: Array, threshold: float) -> SetPoints:
    """Return the course of the current that fits significantly better, or "unknown"."""
    fitter.freeze(free, at)
    moves = _fit(fitter, free, at)
    fitter.batch = _with_held_current(fitter)
    held = _fit(fitter, free, at)
    # shorter blocks than for variances: with few long blocks the standard error is inflated
    predictor, period = fitter.predictor, fitter.experiments[0].period
    block = max(1, round(predictor.correlation_time / period)) * len(predictor.channels)
    error = _error(held.residual**2 - moves.residual**2, block)
    # chi-square includes the priors of the ordinary parameters
    better = held.chi2 - moves.chi2
    if better**2 < threshold * max(error**2, threshold):
        return "unknown"
    return "moves" if better > 0.0 else "held"


def _fit(fitter: Fitter, free: list[Coordinate], at: Array) -> Fit:
    """Return the best fit from several dead times, along which the loss has kinks."""
    period = max(e.period for e in fitter.experiments)
    starts = [at]
    if free[-1].name == DEAD_TIME:
        delays = {float(at[-1]), 0.0, 0.5 * period / free[-1].scale}
        starts = [np.append(at[:-1], start) for start in sorted(delays)]
    return min((_iterated(fitter, free, start) for start in starts), key=lambda fit: fit.chi2)


def _iterated(fitter: Fitter, free: list[Coordinate], start: Array) -> Fit:
    """Return the fit from one starting point."""
    fit = fitter.fit(free, start, ROUNDS)
    for _ in range(PASSES):
        before, fit = fit, fitter.fit(free, fit.at, ROUNDS)
        if before.chi2 - fit.chi2 < SETTLED:
            break
    return fit


def _with_held_current(fitter: Fitter) -> LocalBatch:
    """Return the frozen experiments of a fitter, each with its current held."""
    frozen = [_held(f) for f in fitter.frozen if isinstance(f, Frozen)]
    return LocalBatch(fitter.predictor, frozen, fitter.jobs)


def _held(frozen: Frozen) -> Frozen:
    """Return a frozen experiment with its recorded current, held from row to row."""
    current = np.repeat(frozen.experiment.current[:, None], frozen.data.current.shape[1], axis=1)
    return replace(frozen, data=frozen.data._replace(current=current))


def _error(gain: Array, length: int) -> float:
    """Return the standard error of a summed gain, from blocks longer than its correlation."""
    blocks = np.array_split(gain, max(2, len(gain) // length))
    return float(np.sqrt(sum(block.sum() ** 2 for block in blocks)))
