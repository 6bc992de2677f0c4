"""Parallel prediction of experiments: interface, and implementation with threads."""

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
"""Parameters of plant and sensors; see `PlantModel.memory`."""


TOGETHER = 8
"""Number of sets of sensors that are evaluated along a run at once."""


class Batch(Protocol):
    """Experiments that were frozen together."""

    weight: float
    """Factor of each residual, in addition to the weight of its channel."""

    @property
    def frozen(self) -> Sequence[object]:
        """Weighted results of `Predictor.freeze`, in this process."""

    @property
    def noise(self) -> Noise | None:
        """Common noise; None if each experiment has its own."""

    def sharing(self, noise: Noise) -> "Batch":
        """Return the batch weighted with another common noise."""

    def log_determinant(self) -> float:
        """Return the sum of `Predictor.log_determinant` over the experiments."""

    def residuals(self, points: Sequence[Point], most: float = math.inf) -> Iterator[Array]:
        """Yield the residual of all experiments at each point, flat.

        A residual whose sum of squares exceeds `most` may lack the last experiments.
        """

    def with_other_sensors(self, base: Point, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at points with other sensors, linearised along the run at `base`."""


class Pool(Protocol):
    """Freezes experiments, and stores them where they are predicted."""

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and compute their weights there."""


class Threads:
    """Pool of threads in this process.

    Args:
        predictor: computes innovations.
        jobs: number of threads; each predicts one experiment at a time.

    """

    def __init__(self, predictor: Predictor, jobs: int = 1) -> None:
        self._predictor, self.jobs = predictor, jobs

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and compute their weights there."""
        predictor, jobs = self._predictor, self.jobs
        frozen = list(side_by_side(lambda e: frozen_at(predictor, e, point), experiments, jobs))
        noise = noise_of_all([predictor.noise_estimate(f) for f in frozen])
        batch = LocalBatch(predictor, frozen, jobs)
        return batch if noise is None else batch.sharing(noise)


@dataclass
class LocalBatch:
    """Experiments that were frozen in this process.

    Attributes:
        predictor: that froze them.
        frozen: results of `Predictor.freeze`.
        jobs: threads.
        noise: common noise, or None.
        weight: factor of each residual, in addition to the weight of its channel.

    """

    predictor: Predictor
    frozen: Sequence[object]
    jobs: int = 1
    noise: Noise | None = None
    weight: float = 1.0

    def sharing(self, noise: Noise) -> "LocalBatch":
        """Return the batch weighted with another common noise."""
        frozen = [sharing(self.predictor, f, noise) for f in self.frozen]
        return replace(self, frozen=frozen, noise=noise)

    def log_determinant(self) -> float:
        """Return the sum over the experiments."""
        return sum(self.predictor.log_determinant(f) for f in self.frozen)

    def residuals(self, points: Sequence[Point], most: float = math.inf) -> Iterator[Array]:
        """Yield the residual at each point, truncated if its sum of squares exceeds `most`."""
        trials = [_Trial(self.predictor, point, most / self.weight**2) for point in points]
        for parts in self._each(_Trial.part, trials):
            wanted = [part for part in parts if part is not None]
            yield np.asarray(self.weight * np.concatenate(wanted))

    def with_other_sensors(self, base: Point, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at each point."""

        def of_group(some: Sequence[Point], frozen: object) -> Array:
            return other_sensors(self.predictor, frozen, base, some)

        groups = [points[i : i + TOGETHER] for i in range(0, len(points), TOGETHER)]
        for parts in self._each(of_group, groups):
            yield from self.weight * np.concatenate(parts, axis=1)

    def _each(self, work: Callable[[T, object], R], over: Sequence[T]) -> Iterator[list[R]]:
        """Yield, for each item, the results for all experiments."""
        tasks = [(one, frozen) for one in over for frozen in self.frozen]
        results = side_by_side(lambda task: work(*task), tasks, self.jobs)
        for _ in over:
            yield list(islice(results, len(self.frozen)))


class _Trial:
    """Prediction of all experiments at a point until their sum of squares exceeds a limit."""

    def __init__(self, predictor: Predictor, point: Point, most: float) -> None:
        self._predictor, self._point, self._most = predictor, point, most
        self._powers: list[float] = []

    def part(self, frozen: object) -> Array | None:
        """Return the residual of the next experiment; None after the limit was exceeded."""
        if sum(self._powers) > self._most:
            return None
        part = residual(self._predictor, frozen, self._point)
        self._powers.append(float(part @ part))
        return part


def side_by_side(work: Callable[[T], R], over: Sequence[T], jobs: int) -> Iterator[R]:
    """Yield results in order, computed by threads; the compiled code releases the GIL."""
    if jobs <= 1 or len(over) <= 1:
        yield from map(work, over)
        return
    with ThreadPoolExecutor(jobs) as threads:
        yield from threads.map(work, over)


def by_turns(work: Callable[[T], R], over: Sequence[T], jobs: int) -> Iterator[R]:
    """Yield results in order, at most `jobs` at a time in memory."""
    for first in range(0, len(over), jobs):
        yield from side_by_side(work, over[first : first + jobs], jobs)


def noise_of_all(correlograms: Sequence[Correlogram | None]) -> Noise | None:
    """Return the common noise of experiments; None if each has its own."""
    present = [c for c in correlograms if c is not None]
    return shared(present) if present else None


def sharing(predictor: Predictor, frozen: object, noise: Noise) -> object:
    """Return a copy of a frozen experiment, weighted with a common noise."""
    other = copy.copy(frozen)
    predictor.share(other, noise)
    return other


def frozen_at(predictor: Predictor, experiment: Experiment, point: Point) -> object:
    """Return an experiment, frozen and weighted at a point."""
    frozen = predictor.freeze(experiment, *point)
    predictor.weigh(frozen, *point)
    return frozen


def residual(predictor: Predictor, frozen: object, point: Point) -> Array:
    """Return the residual of one experiment at a point, flat."""
    return tamed(predictor.innovations(frozen, *point)[0]).ravel()


def other_sensors(
    predictor: Predictor, frozen: object, base: Point, points: Sequence[Point]
) -> Array:
    """Return one experiment's residuals with other sensors and the plant of `base`, each flat."""
    residuals = predictor.with_other_sensors(frozen, *base, [chan for _, chan in points])
    return tamed(residuals).reshape(len(points), -1)
