"""The pool of a Dask cluster: frozen experiments stay on the worker that made them."""

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import (
    Batch,
    Point,
    frozen_at,
    noise_of_all,
    other_sensors,
    residual,
    sharing,
)
from hil_emulator.identify.prediction.parallel.serialise import Serialised, deserialised, serialised
from hil_emulator.identify.prediction.residuals.correlation import Correlogram, Noise
from hil_emulator.platform.cluster import gathered

LARGEST = 2**26
"""Size of what one task returns [B] (assumed: a fraction of a worker's memory)."""

T = TypeVar("T")


class ClusterPool:
    """Predicts on the workers of a cluster, one experiment per task.

    Args:
        client: a `distributed.Client`; the caller closes it.
        predictor: of this process; the workers build their own like it.

    """

    def __init__(self, client: Any, predictor: Predictor) -> None:
        self._client = client
        self._predictor = _sent(client, [serialised(predictor)])[0]
        self._experiments: dict[int, tuple[Experiment, Any]] = {}

    def freeze(self, experiments: Sequence[Experiment], point: Point) -> Batch:
        """Freeze experiments at a point and weigh their channels there."""
        new = [e for e in experiments if id(e) not in self._experiments]
        for experiment, future in zip(new, _sent(self._client, new), strict=True):
            self._experiments[id(experiment)] = experiment, future
        futures = [self._experiments[id(e)][1] for e in experiments]
        kept = _mapped(self._client, _freeze, futures, self._predictor, point)
        seen = gathered(self._client, _mapped(self._client, _seen, kept, self._predictor))
        noise = noise_of_all(seen)
        largest = max((e.samples * len(e.readings) * 8 for e in experiments), default=1)
        batch = ClusterBatch(self._client, self._predictor, kept, max(1, LARGEST // largest))
        return batch if noise is None else batch.sharing(noise)


class ClusterBatch:
    """Experiments that were frozen on workers.

    Args:
        client: of the cluster.
        predictor: future of the predictor.
        kept: futures of the frozen experiments.
        points: most points per task.
        noise: that they share.

    """

    weight = 1.0

    def __init__(
        self, client: Any, predictor: Any, kept: Sequence[Any], points: int,
        noise: Noise | None = None,
    ) -> None:  # fmt: skip
        self._client, self._predictor, self._kept = client, predictor, kept
        self._points, self.noise = points, noise

    @cached_property
    def frozen(self) -> Sequence[object]:
        """The frozen experiments, fetched."""
        return [kept.frozen for kept in gathered(self._client, self._kept)]

    def sharing(self, noise: Noise) -> "ClusterBatch":
        """Return the same, weighed by another noise."""
        kept = _mapped(self._client, _shared, self._kept, self._predictor, noise)
        return ClusterBatch(self._client, self._predictor, kept, self._points, noise)

    def log_determinant(self) -> float:
        """Return the sum over the experiments."""
        each = _mapped(self._client, _log_determinant, self._kept, self._predictor)
        return float(sum(gathered(self._client, each)))

    def residuals(self, points: Sequence[Point], most: float = math.inf) -> Iterator[Array]:
        """Yield the residual at each point, flat and whole, of all experiments in their order."""
        yield from self._in_parts(points, _residuals)

    def with_other_sensors(self, base: Point, points: Sequence[Point]) -> Iterator[Array]:
        """Yield the residual at points with the plant of another one, linearised along that."""
        yield from self._in_parts(points, _other_sensors, base)

    def _in_parts(
        self, points: Sequence[Point], task: Callable[..., Any], *same: Any
    ) -> Iterator[Array]:
        """Yield what tasks return of each point, of all experiments in their order."""
        parts = [points[i : i + self._points] for i in range(0, len(points), self._points)]
        waiting = [
            _mapped(self._client, task, self._kept, self._predictor, sent, *same)
            for sent in _sent(self._client, parts)
        ]
        for part in parts:
            done = gathered(self._client, waiting.pop(0))
            for i in range(len(part)):
                yield np.concatenate([experiment[i] for experiment in done])


@dataclass
class _Kept:
    """A frozen experiment, as large as it is: Dask weighs what it would cost to move it."""

    frozen: object

    def __sizeof__(self) -> int:
        return _bytes(tuple(vars(self.frozen).values()))


def _bytes(value: object) -> int:
    """Return the size of an array, or of those in a tuple."""
    if isinstance(value, tuple):
        return sum(map(_bytes, value))
    return value.nbytes if isinstance(value, np.ndarray) else 0


def _sent(client: Any, things: Sequence[Any]) -> list[Any]:
    """Send things as results of tasks: what was scattered is lost with the worker that has it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sending large graph")
        return list(client.map(_same, things, pure=False))


def _mapped(client: Any, function: Callable[..., Any], each: Sequence[Any], *same: Any) -> Any:
    """Submit a task for each of several futures, with the same further arguments."""
    # not as keywords: Client.map makes large ones tasks of one name, which collide
    return client.map(function, each, *([thing] * len(each) for thing in same), pure=False)


def _same(thing: T) -> T:
    return thing


def _freeze(experiment: Experiment, predictor: Serialised, point: Point) -> _Kept:
    return _Kept(frozen_at(deserialised(predictor), experiment, point))


def _seen(kept: _Kept, predictor: Serialised) -> Correlogram | None:
    return deserialised(predictor).noise_estimate(kept.frozen)


def _log_determinant(kept: _Kept, predictor: Serialised) -> float:
    return deserialised(predictor).log_determinant(kept.frozen)


def _shared(kept: _Kept, predictor: Serialised, noise: Noise) -> _Kept:
    return _Kept(sharing(deserialised(predictor), kept.frozen, noise))


def _residuals(kept: _Kept, predictor: Serialised, points: Sequence[Point]) -> Array:
    built = deserialised(predictor)
    return np.stack([residual(built, kept.frozen, point) for point in points])


def _other_sensors(
    kept: _Kept, predictor: Serialised, points: Sequence[Point], base: Point
) -> Array:
    built = deserialised(predictor)
    return other_sensors(built, kept.frozen, base, points)
