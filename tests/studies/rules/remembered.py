"""Predictions that are computed once: the same question about the same data costs nothing again.

What a search does until a rule that was left out first matters is what it did with the rule. So the
expensive work, all of it in the observer, is kept by what it depends on.
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
"""Bytes beyond which everything is forgotten, and computed anew."""

_OWN = {n: getattr(Observer, n) for n in ("freeze", "weigh", "innovations", "through")}


class Memory:
    """What an observer has said of the experiments of one case, by what it was asked."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], Any] = {}
        self._bytes = 0.0

    def of(self, asked: tuple[object, ...], compute: Callable[[], Any], size: float) -> Any:
        """Return an answer that is known, or compute and keep it."""
        if asked not in self._known:
            if self._bytes > LARGEST:
                self._known, self._bytes = {}, 0.0
            self._known[asked] = compute()
            self._bytes += size
        return self._known[asked]

    def freeze(self, own: Observer, experiment: Any, par: Array, chan: Array) -> Frozen:
        """Return an experiment with its gains, which takes weights of its own."""
        course = experiment.currents.current
        asked = ("freeze", experiment.name, hash(course.tobytes()), par.tobytes(), chan.tobytes())
        found = self.of(asked, lambda: _OWN["freeze"](own, experiment, par, chan), 3e6)
        found.asked = asked
        return found  # type: ignore[no-any-return]

    def weigh(self, own: Observer, frozen: Any, par: Array, chan: Array) -> None:
        """Weigh an experiment as it was before."""
        asked = ("weigh", *frozen.asked, par.tobytes(), chan.tobytes())

        def weights() -> Array:
            _OWN["weigh"](own, frozen, par, chan)
            return frozen.weights.copy()  # type: ignore[no-any-return]

        frozen.weights = self.of(asked, weights, 0.0).copy()

    def innovations(
        self, own: Observer, frozen: Any, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the innovations of an experiment at a point."""
        if not hasattr(frozen, "asked"):  # another one made of what was frozen
            return _OWN["innovations"](own, frozen, par, chan, track)  # type: ignore[no-any-return]
        asked = ("innovations", *frozen.asked, frozen.weights.tobytes(), par.tobytes(),
                 chan.tobytes(), track)  # fmt: skip
        size = frozen.data.measured.nbytes * (5.0 if track else 1.0)
        found = self.of(asked, lambda: _OWN["innovations"](own, frozen, par, chan, track), size)
        return found[0].copy(), found[1].copy()

    def through(self, own: Observer, frozen: Any, balance: Balance, terms: Array) -> Array:
        """Return what terms do to the innovations of an experiment."""
        asked = ("through", *frozen.asked, frozen.weights.tobytes(), balance.name,
                 hash(np.ascontiguousarray(terms).tobytes()))  # fmt: skip
        size = frozen.data.measured.nbytes * terms.shape[1]
        return self.of(asked, lambda: _OWN["through"](own, frozen, balance, terms), size).copy()  # type: ignore[no-any-return]


@contextmanager
def remembered() -> Iterator[Memory]:
    """Let every observer remember, for as long as one campaign is examined."""
    memory = Memory()
    try:
        for name in _OWN:
            setattr(Observer, name, _method(memory, name))
        yield memory
    finally:
        for name, own in _OWN.items():
            setattr(Observer, name, own)


def _method(memory: Memory, name: str) -> Callable[..., Any]:
    told = getattr(memory, name)
    return lambda own, *asked, **named: told(own, *asked, **named)
