"""Whether the current was held from row to row of a recording, or moved in between.

A log cannot show it, but the machine does: a current that moved has moved the spool. Both answers
are tried with the same gains, each with its own ordinary parameters and a dead time of its own,
because a current that is held comes half a period late on average.
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
"""The effect that makes a current late."""

ROUNDS = 5
"""Iterations with one Jacobian, which is corrected on the way (assumed)."""

PASSES = 10
"""Jacobians of a fit: far more than it needs, as where a valve is fitted beside a dead time it
creeps along a valley. Fits that had stopped there were up to 3000 apart in chi-square, and told of
two in twelve healthy axes what their currents did not do."""

SETTLED = 1.0
"""Gain in chi-square of a Jacobian below which it was the last: it says next to nothing beside
what tells two answers apart."""


@dataclass(frozen=True)
class Investigation:
    """What is examined, for what, and what is known of the current between its rows.

    Attributes:
        learn: experiments for the fit, with the course of their current where it moves.
        check: the same for the acceptance test.
        nuisances: ordinary parameters; a dead time is one where nobody can tell it from a hold.
        candidates: effects that may be named.
        answer: what the current did between the rows of loggers slower than a controller.

    """

    learn: list[Experiment]
    check: list[Experiment]
    nuisances: list[Coordinate]
    candidates: list[Coordinate]
    answer: SetPoints = "held"


def followed(
    predictor: Predictor, given: Investigation, apart: float,
    report: Callable[[str], None] = lambda _: None, model: Fit | None = None,
    told: SetPoints = "unknown", jobs: int = 1,
) -> Investigation:  # fmt: skip
    """Find out what the current did between rows, and say it in the experiments' notes.

    Args:
        predictor: computes innovations.
        given: what is examined, the current as it was recorded.
        apart: chi-square by which one answer has to be better than the other.
        tell: takes progress in words.
        model: what is known to act; nothing beside what is configured, if not given. What is
            missing may look like either answer.
        told: what the user says of it; then nobody asks.
        jobs: threads.

    """
    slow = [e for e in given.learn if len(e.current) and slower_than_controller(e)]
    if not slow or not isinstance(predictor, Observer):
        return given if told == "unknown" else _needless(given)
    if told != "unknown":
        return _with(given, told, "you say")
    report("asking whether the current changed between the rows")
    dead_time = [c for c in candidates(predictor.model, ()) if c.name == DEAD_TIME]
    fitter = Fitter(predictor, [moving(e) for e in slow], Threads(predictor, jobs))
    known = given.nuisances if model is None else model.coordinates
    free = [*(c for c in known if c.name != DEAD_TIME), *dead_time]
    values = {} if model is None else {c.name: a for c, a in zip(known, model.at, strict=True)}
    answer = _answer(fitter, free, np.array([values.get(c.name, 0.0) for c in free]), apart)
    found = _with(given, answer, "the readings show")
    if answer != "unknown":
        return found
    period = max(e.period for e in slow)
    dead_time = [replace(c, prior=period / c.scale) for c in dead_time]
    rest = [c for c in given.candidates if c.name != DEAD_TIME]
    return replace(found, nuisances=[*given.nuisances, *dead_time], candidates=rest)


def hold(experiments: Sequence[Experiment]) -> float:
    """Return how much later a current that is held from row to row comes than one that moves [s].

    On average, by half a period less half of the controller's.
    """
    return 0.5 * (max(e.period for e in experiments) - CONTROLLER)


def held(given: Investigation, why: str) -> Investigation:
    """Return the same with the current held, where the readings tell nothing of it."""
    return _with(given, "held", why)


def late(given: Investigation) -> Investigation:
    """Return the same with a current that comes later than one that is held: a dead time acts."""
    return _with(given, "unknown", "the readings show, but it is later than one that is held")


def shifts(
    predictor: Predictor, experiments: Sequence[Experiment], fit: Fit, jobs: int = 1
) -> dict[str, float]:
    """Return how far the coordinates of a model move if the current was held from row to row.

    Then nothing else makes it late, but a dead time that was named.

    Args:
        predictor: computes innovations.
        experiments: for the fit, with a course of the current that moves.
        fit: the model there.
        jobs: threads.

    """
    kept = [i for i, c in enumerate(fit.coordinates)
            if c.name != DEAD_TIME or not np.isfinite(c.prior)]  # fmt: skip
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    fitter = Fitter(predictor, experiments, Threads(predictor, jobs))
    fitter.freeze(free, at)
    fitter.batch = _with_held_current(fitter)
    found = _settled(fitter, free, at)
    return {c.name: float(there - here)
            for c, there, here in zip(free, found.at, at, strict=True)}  # fmt: skip


_SAID: dict[SetPoints, str] = {
    "held": "held from row to row, as",
    "moves": "it changes between the rows, as",
    "unknown": "whether it changes between the rows or comes late is more than",
}


def _needless(given: Investigation) -> Investigation:
    """Return the same, with a note that nothing was to be said of the current."""
    said = "valve_current: what --set-points says changes nothing in data like these"
    learn, check = ([replace(e, notes=(*e.notes, said)) for e in part]
                    for part in (given.learn, given.check))  # fmt: skip
    return replace(given, learn=learn, check=check)


def _with(given: Investigation, answer: SetPoints, who: str) -> Investigation:
    """Return the same with what the current did between rows, and who says so."""
    said = f"valve_current: {_SAID[answer]} {who}"
    learn, check = ([_as(answer, e, said) for e in part] for part in (given.learn, given.check))
    return replace(given, learn=learn, check=check, answer=answer)


def _as(answer: SetPoints, e: Experiment, said: str) -> Experiment:
    """Return an experiment with what its current did between rows."""
    if not slower_than_controller(e):
        return e
    if answer == "held":
        return replace(e, notes=(*e.notes, said))
    taken = f"taken along a curve through them, in steps of {CONTROLLER * 1e3:g} ms (assumed)"
    return moving(replace(e, notes=(*e.notes, f"{said}; {taken}")))


def _answer(fitter: Fitter, free: list[Coordinate], at: Array, apart: float) -> SetPoints:
    """Return which course of the current the readings follow, if it is better by enough."""
    fitter.freeze(free, at)
    moves = _fit(fitter, free, at)
    fitter.batch = _with_held_current(fitter)
    held = _fit(fitter, free, at)
    # this error is not about a mean: of a few long blocks, any gain would look unsure
    predictor, period = fitter.predictor, fitter.experiments[0].period
    block = max(1, round(predictor.correlation_time / period)) * len(predictor.channels)
    error = _error(held.residual**2 - moves.residual**2, block)
    # what ordinary parameters have to be for it counts, too
    better = held.chi2 - moves.chi2
    if better**2 < apart * max(error**2, apart):
        return "unknown"
    return "moves" if better > 0.0 else "held"


def _fit(fitter: Fitter, free: list[Coordinate], at: Array) -> Fit:
    """Return the best fit from any dead time: at every part of a period it has a kink."""
    period = max(e.period for e in fitter.experiments)
    starts = [at]
    if free[-1].name == DEAD_TIME:
        begun = {float(at[-1]), 0.0, 0.5 * period / free[-1].scale}
        starts = [np.append(at[:-1], start) for start in sorted(begun)]
    return min((_settled(fitter, free, start) for start in starts), key=lambda fit: fit.chi2)


def _settled(fitter: Fitter, free: list[Coordinate], start: Array) -> Fit:
    """Return the best fit from one start."""
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
    """Return a frozen experiment whose current is held, whatever it was frozen with."""
    current = np.repeat(frozen.experiment.current[:, None], frozen.data.current.shape[1], axis=1)
    return replace(frozen, data=frozen.data._replace(current=current))


def _error(gain: Array, length: int) -> float:
    """Return a gain's standard error, from blocks that are longer than it is correlated."""
    blocks = np.array_split(gain, max(2, len(gain) // length))
    return float(np.sqrt(sum(block.sum() ** 2 for block in blocks)))
