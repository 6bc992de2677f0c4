"""Integrations of the model that are compiled for the acting effects only.

A step then takes two thirds of the time, see `model.acting`.
"""

import hashlib
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from threading import Lock

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.records import Tick
from hil_emulator.identify.prediction.plant.function_values import TICK, FunctionValue
from hil_emulator.identify.prediction.plant.probes import DRIFT
from hil_emulator.model.acting import build_acting, has_parts
from hil_emulator.model.checked_cache import write_whole
from hil_emulator.model.kernel import Kernel, sources_digest
from hil_emulator.model.stages import SAMPLED

WORTH_COMPILING = 2_500_000
"""Number of integration steps with a set of effects from which compiling for it pays off: it takes
0.8 s if this process has compiled the whole model (measured)."""

WORTH_COMPILING_ALL = 15_000_000
"""The same if the whole model was loaded from the cache; compiling its parts takes 4 s more."""

WORTH_LOADING = 500_000
"""The same for code in the cache: a step takes 0.2 us less, loading takes 0.1 s (measured)."""

OWN_PART = 0.5
"""Share of these steps with exactly this set of effects. For one minute of data, a named effect
needs four times as many steps, a candidate that is refitted once 0.45 of them (measured)."""


class Ticks:
    """The integrations of one model.

    Args:
        whole: kernel with all effects.
        cache: folder for machine code; None compiles for this process alone.

    """

    def __init__(self, whole: Kernel, cache: Path | None) -> None:
        self._kernel, self._cache = whole, cache
        self.whole: Tick = FunctionValue(whole.tick, TICK)
        at = {name: i for i, name in enumerate(whole.parameters.names or ())}
        self._knobs = [(e, at[e.field_of(e.knob)]) for e in whole.effects
                       if e.stage not in SAMPLED]  # fmt: skip
        self._ticks: dict[frozenset[str], Tick | None] = dict.fromkeys(self._cached())
        self._used: Counter[frozenset[str]] = Counter()
        self._compiling = Lock()

    def at(self, par: Array, steps: int) -> Tick:
        """Return the smallest integration that has all acting effects, for the sensors' signals.

        Args:
            par: parameters of the plant.
            steps: number of integration steps that it will be used for.

        """
        acting = frozenset(e.name for e, i in self._knobs if par[i] != e.off or e is DRIFT)
        able = sorted((names for names in list(self._ticks) if acting <= names), key=len)
        least = able[0] if able else acting
        if self._ticks.get(least) is None:
            self._used[least] += steps
            if not self._pays_off(least, bool(able)):
                return next((tick for names in able if (tick := self._ticks[names])), self.whole)
        return self._tick(least)

    def _pays_off(self, names: frozenset[str], cached: bool) -> bool:
        """Return whether code for some effects pays off, given the steps it would have taken.

        Args:
            names: of the effects.
            cached: whether the cache has code for them.

        """
        used = self._used[names]
        if cached:
            return used >= WORTH_LOADING
        worth = WORTH_COMPILING if has_parts(self._kernel) else WORTH_COMPILING_ALL
        # other threads count as well
        taken = sum(steps for acting, steps in list(self._used.items())
                    if acting <= names and acting not in self._ticks)  # fmt: skip
        return used >= OWN_PART * worth and taken >= worth

    def _tick(self, names: frozenset[str]) -> Tick:
        """Return the integration for some effects; the whole one while another is compiled."""
        tick = self._ticks.get(names)
        if tick is None and self._compiling.acquire(blocking=False):
            try:
                tick = self._ticks[names] = self._compiled(names)
            finally:
                self._compiling.release()
        return tick or self.whole

    def _compiled(self, names: frozenset[str]) -> Tick:
        whole, acting = self._kernel, [e for e in self._kernel.effects if e.name in names]
        tick = FunctionValue(build_acting(whole, acting, self._cache), TICK)
        if folder := self._folder():
            text = " ".join(sorted(names))
            with suppress(OSError):
                write_whole(folder / _file_name(text), text)
        return tick

    def _cached(self) -> Iterator[frozenset[str]]:
        """Yield the sets of effects with code in the cache."""
        if folder := self._folder():
            for file in folder.glob("*.acting"):
                with suppress(OSError, UnicodeError):
                    text = file.read_text()
                    if file.name == _file_name(text):
                        yield frozenset(text.split())

    def _folder(self) -> Path | None:
        """Return the folder with the list of compiled sets of effects for this model."""
        if self._cache is None:
            return None
        model = hashlib.sha256(self._kernel.source.encode()).hexdigest()[:8]
        folder = self._cache / sources_digest(self._kernel.effects) / f"acting_{model}"
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
        return folder


def _file_name(names: str) -> str:
    """Return the file name for a list of effects: its digest, which detects damaged files."""
    return f"{hashlib.sha256(names.encode()).hexdigest()[:16]}.acting"
