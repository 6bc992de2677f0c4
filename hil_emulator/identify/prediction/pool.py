"""Where the experiments of a campaign are predicted: here on threads, or on a cluster."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.huber import tamed
from hil_emulator.identify.prediction.predictor import Predictor

Point = tuple[Array, Array]
"""The plant's and the sensors' parameters; see `Twin.memory`."""


class Batch(Protocol):
    """Experiments that were frozen together."""

    @property
    def frozen(self) -> Sequence[Any]:
        """What `Predictor.freeze` made of each, weighed, in this process."""

    def residuals(self, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at each point, flat, of all experiments in their order."""


class Pool(Protocol):
    """Freezes experiments, and keeps them where they are predicted."""

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and weigh their channels there."""


class Threads:
    """The pool of this process.

    Args:
        predictor: computes innovations.
        jobs: threads; each takes one point at a time.

    """

    def __init__(self, predictor: Predictor, jobs: int = 1) -> None:
        self._predictor, self._jobs = predictor, jobs

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and weigh their channels there."""
        frozen = [frozen_at(self._predictor, e, point) for e in experiments]
        return LocalBatch(self._predictor, frozen, self._jobs)


@dataclass
class LocalBatch:
    """Experiments that were frozen in this process.

    Attributes:
        predictor: has frozen them.
        frozen: what it made of each.
        jobs: threads.

    """

    predictor: Predictor
    frozen: Sequence[Any]
    jobs: int = 1

    def residuals(self, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at each point; the compiled code does not hold the interpreter."""
        if self.jobs <= 1 or len(points) == 1:
            yield from map(self._residual, points)
            return
        with ThreadPoolExecutor(self.jobs) as threads:
            yield from threads.map(self._residual, points)

    def _residual(self, point: Point) -> Array:
        return np.concatenate([residual(self.predictor, f, point) for f in self.frozen])


def frozen_at(predictor: Predictor, experiment: Experiment, point: Point) -> Any:
    """Return an experiment frozen and weighed at a point."""
    frozen = predictor.freeze(experiment, *point)
    predictor.weigh(frozen, *point)
    return frozen


def residual(predictor: Predictor, frozen: Any, point: Point) -> Array:
    """Return the residual of one experiment at a point, flat."""
    return tamed(predictor.innovations(frozen, *point)[0])
