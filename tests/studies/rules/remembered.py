"""Predictions that are computed once for the same data and parameters.

A search without a rule takes the same steps as with it, until the rule matters first. So the
expensive work, all of it in the observer, is cached by its inputs.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer

LARGEST = 4e9
"""Size above which the cache is emptied [B]."""

_ORIGINAL = {n: getattr(Observer, n) for n in ("freeze", "weigh", "innovations", "through")}


class Memory:
    """Results of an observer for the experiments of one case, by its inputs."""

    def __init__(self) -> None:
        self._results: dict[tuple[object, ...], Any] = {}
        self._bytes = 0.0

    def of(self, asked: tuple[object, ...], compute: Callable[[], Any], size: float) -> Any:
        """Return a cached result, or compute and cache it."""
        if asked not in self._results:
            if self._bytes > LARGEST:
                self._results, self._bytes = {}, 0.0
            self._results[asked] = compute()
            self._bytes += size
        return self._results[asked]

    def freeze(self, observer: Observer, experiment: Any, par: Array, chan: Array) -> Frozen:
        """Return an experiment with its gains, which takes its weights."""
        course = experiment.currents.current
        asked = ("freeze", experiment.name, hash(course.tobytes()), par.tobytes(), chan.tobytes())
        result = self.of(asked, lambda: _ORIGINAL["freeze"](observer, experiment, par, chan), 3e6)
        result.asked = asked
        return result  # type: ignore[no-any-return]

    def weigh(self, observer: Observer, frozen: Any, par: Array, chan: Array) -> None:
        """Weigh an experiment as it was before."""
        asked = ("weigh", *frozen.asked, par.tobytes(), chan.tobytes())

        def weights() -> Array:
            _ORIGINAL["weigh"](observer, frozen, par, chan)
            return frozen.weights.copy()  # type: ignore[no-any-return]

        frozen.weights = self.of(asked, weights, 0.0).copy()

    def innovations(
        self, observer: Observer, frozen: Any, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the innovations of an experiment at a point."""
        if not hasattr(frozen, "asked"):  # another one made of what was frozen
            return _ORIGINAL["innovations"](observer, frozen, par, chan, track)  # type: ignore[no-any-return]
        asked = ("innovations", *frozen.asked, frozen.weights.tobytes(), par.tobytes(),
                 chan.tobytes(), track)  # fmt: skip
        size = frozen.data.measured.nbytes * (5.0 if track else 1.0)
        result = self.of(
            asked, lambda: _ORIGINAL["innovations"](observer, frozen, par, chan, track), size
        )
        return result[0].copy(), result[1].copy()

    def through(self, observer: Observer, frozen: Any, balance: Balance, terms: Array) -> Array:
        """Return what terms do to the innovations of an experiment."""
        asked = ("through", *frozen.asked, frozen.weights.tobytes(), balance.name,
                 hash(np.ascontiguousarray(terms).tobytes()))  # fmt: skip
        size = frozen.data.measured.nbytes * terms.shape[1]
        return self.of(
            asked, lambda: _ORIGINAL["through"](observer, frozen, balance, terms), size
        ).copy()  # type: ignore[no-any-return]


@contextmanager
def remembered() -> Iterator[Memory]:
    """Let every observer use the cache while one campaign is examined."""
    memory = Memory()
    try:
        for name in _ORIGINAL:
            setattr(Observer, name, _method(memory, name))
        yield memory
    finally:
        for name, observer in _ORIGINAL.items():
            setattr(Observer, name, observer)


def _method(memory: Memory, name: str) -> Callable[..., Any]:
    cached = getattr(memory, name)
    return lambda observer, *asked, **named: cached(observer, *asked, **named)
