"""Where the experiments of a campaign are predicted: here on threads, or on a cluster."""

import copy
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from typing import Protocol, TypeVar

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.residuals.correlation import Correlogram, Noise, shared
from hil_emulator.identify.prediction.residuals.huber import tamed

T = TypeVar("T")
R = TypeVar("R")

Point = tuple[Array, Array]
"""The plant's and the sensors' parameters; see `PlantModel.memory`."""


TOGETHER = 8
"""Sets of sensors that are carried along a run together."""


class Batch(Protocol):
    """Experiments that were frozen together."""

    weight: float
    """Of each residual, beside that of its channel."""

    @property
    def frozen(self) -> Sequence[object]:
        """What `Predictor.freeze` made of each, weighed, in this process."""

    @property
    def noise(self) -> Noise | None:
        """The noise that they share; None where each has its own."""

    def sharing(self, noise: Noise) -> "Batch":
        """Return the same, weighed by another noise."""

    def log_determinant(self) -> float:
        """Return the sum of `Predictor.log_determinant` over the experiments."""

    def residuals(self, points: Sequence[Point], most: float = math.inf) -> Iterator[Array]:
        """Yield the residual at each point, flat, of all experiments in their order.

        One whose sum of squares exceeds `most` may lack the last experiments.
        """

    def with_other_sensors(self, base: Point, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at points with the plant of another one, linearised along that."""


class Pool(Protocol):
    """Freezes experiments, and keeps them where they are predicted."""

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and weigh their channels there."""


class Threads:
    """The pool of this process.

    Args:
        predictor: computes innovations.
        jobs: threads; each takes one experiment of a point at a time.
        exact: whether base laws have the model's form alone.

    """

    def __init__(self, predictor: Predictor, jobs: int = 1, *, exact: bool = False) -> None:
        self._predictor, self.jobs, self._exact = predictor, jobs, exact

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and weigh their channels there."""
        predictor, jobs = self._predictor, self.jobs
        frozen = list(side_by_side(
            lambda e: frozen_at(predictor, e, point, exact=self._exact), experiments, jobs
        ))  # fmt: skip
        noise = noise_of_all([predictor.noise_estimate(f) for f in frozen])
        batch = LocalBatch(predictor, frozen, jobs)
        return batch if noise is None else batch.sharing(noise)


@dataclass
class LocalBatch:
    """Experiments that were frozen in this process.

    Attributes:
        predictor: has frozen them.
        frozen: what it made of each.
        jobs: threads.
        noise: that they share.
        weight: of each residual, beside that of its channel.

    """

    predictor: Predictor
    frozen: Sequence[object]
    jobs: int = 1
    noise: Noise | None = None
    weight: float = 1.0

    def sharing(self, noise: Noise) -> "LocalBatch":
        """Return the same, weighed by another noise."""
        frozen = [sharing(self.predictor, f, noise) for f in self.frozen]
        return replace(self, frozen=frozen, noise=noise)

    def log_determinant(self) -> float:
        """Return the sum over the experiments."""
        return sum(self.predictor.log_determinant(f) for f in self.frozen)

    def residuals(self, points: Sequence[Point], most: float = math.inf) -> Iterator[Array]:
        """Yield the residual at each point, as far as its sum of squares is wanted."""
        trials = [_Trial(self.predictor, point, most / self.weight**2) for point in points]
        for parts in self._each(_Trial.part, trials):
            wanted = [part for part in parts if part is not None]
            yield np.asarray(self.weight * np.concatenate(wanted))

    def with_other_sensors(self, base: Point, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at each point."""

        def seen(some: Sequence[Point], frozen: object) -> Array:
            return other_sensors(self.predictor, frozen, base, some)

        groups = [points[i : i + TOGETHER] for i in range(0, len(points), TOGETHER)]
        for parts in self._each(seen, groups):
            yield from self.weight * np.concatenate(parts, axis=1)

    def _each(self, work: Callable[[T, object], R], over: Sequence[T]) -> Iterator[list[R]]:
        """Yield the work on each, of all experiments; a thread takes one of these at a time."""
        tasks = [(one, frozen) for one in over for frozen in self.frozen]
        made = side_by_side(lambda task: work(*task), tasks, self.jobs)
        for _ in over:
            yield list(islice(made, len(self.frozen)))


class _Trial:
    """A point at which all experiments are predicted, as long as their sum of squares is wanted."""

    def __init__(self, predictor: Predictor, point: Point, most: float) -> None:
        self._predictor, self._point, self._most = predictor, point, most
        self._powers: list[float] = []

    def part(self, frozen: object) -> Array | None:
        """Return the residual of the next experiment; None, as of all later ones, beyond that."""
        if sum(self._powers) > self._most:
            return None
        found = residual(self._predictor, frozen, self._point)
        self._powers.append(float(found @ found))
        return found


def side_by_side(work: Callable[[T], R], over: Sequence[T], jobs: int) -> Iterator[R]:
    """Yield the work on each in order; the compiled code does not hold the interpreter."""
    if jobs <= 1 or len(over) <= 1:
        yield from map(work, over)
        return
    with ThreadPoolExecutor(jobs) as threads:
        yield from threads.map(work, over)


def by_turns(work: Callable[[T], R], over: Sequence[T], jobs: int) -> Iterator[R]:
    """Yield the same, where what is made would fill the memory: one for each thread at a time."""
    for first in range(0, len(over), jobs):
        yield from side_by_side(work, over[first : first + jobs], jobs)


def noise_of_all(seen: Sequence[Correlogram | None]) -> Noise | None:
    """Return the noise that experiments share; None where each has its own."""
    told = [c for c in seen if c is not None]
    return shared(told) if told else None


def sharing(predictor: Predictor, frozen: object, noise: Noise) -> object:
    """Return a frozen experiment weighed by a noise that all share; the one given stays."""
    other = copy.copy(frozen)
    predictor.share(other, noise)
    return other


def frozen_at(
    predictor: Predictor, experiment: Experiment, point: Point, *, exact: bool = False
) -> object:
    """Return an experiment frozen and weighed at a point."""
    frozen = predictor.freeze(experiment, *point)
    predictor.weigh(frozen, *point)
    if not exact:
        predictor.relax(frozen, *point)
    return frozen


def residual(predictor: Predictor, frozen: object, point: Point) -> Array:
    """Return the residual of one experiment at a point, flat."""
    return predictor.integrated_out(frozen, tamed(predictor.innovations(frozen, *point)[0]))


def other_sensors(
    predictor: Predictor, frozen: object, base: Point, points: Sequence[Point]
) -> Array:
    """Return the residual of one experiment at points with the plant of another one, each flat."""
    found = predictor.with_other_sensors(frozen, *base, [chan for _, chan in points])
    return predictor.integrated_out(frozen, tamed(found).reshape(len(points), -1))
