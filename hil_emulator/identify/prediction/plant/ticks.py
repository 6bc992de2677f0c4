"""The model's integration, compiled once more for the effects that act in most predictions.

Code that knows only what acts takes two thirds of the time for a step, see `model.acting`.
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
from hil_emulator.model.kernel import Kernel, sources_digest
from hil_emulator.model.stages import SAMPLED

WORTH_COMPILING = 2_500_000
"""Integration steps with no other effects after which code for these is worth its making, 0.8 s:
what it is made of is there, as this process has compiled the whole model (measured)."""

WORTH_COMPILING_ALL = 15_000_000
"""The same where the whole model came from the cache, without what it is made of: 4 s more."""

WORTH_LOADING = 500_000
"""The same for code that the cache holds: a step takes 0.2 us less, loading the code takes 0.1 s
(measured); a cache that has grown holds code for what a search asks about once."""

OWN_PART = 0.5
"""Part of the steps worth compiling for in which exactly these effects must have acted: of a minute
of data, one that is named asks for four times as many, a candidate that is only refitted for 0.45
of them (measured)."""


class Ticks:
    """The integrations of one model.

    Args:
        whole: the kernel that knows every effect.
        cache: folder for machine code; None compiles for this process alone.

    """

    def __init__(self, whole: Kernel, cache: Path | None) -> None:
        self._kernel, self._cache = whole, cache
        self.whole: Tick = FunctionValue(whole.tick, TICK)
        at = {name: i for i, name in enumerate(whole.parameters.names or ())}
        self._knobs = [(e, at[e.field_of(e.knob)]) for e in whole.effects
                       if e.stage not in SAMPLED]  # fmt: skip
        self._made: dict[frozenset[str], Tick | None] = dict.fromkeys(self._kept())
        self._used: Counter[frozenset[str]] = Counter()
        self._making = Lock()

    def at(self, par: Array, steps: int) -> Tick:
        """Return the integration at some parameters, for so many steps, of what sensors see.

        Of those that know what acts there, it is the one that knows the least.
        """
        acting = frozenset(e.name for e, i in self._knobs if par[i] != e.off or e is DRIFT)
        able = sorted((known for known in list(self._made) if acting <= known), key=len)
        least = able[0] if able else acting
        if self._made.get(least) is None:
            self._used[least] += steps
            if not self._worthwhile(least, bool(able)):
                return next((made for known in able if (made := self._made[known])), self.whole)
        return self._tick(least)

    def _worthwhile(self, known: frozenset[str], kept: bool) -> bool:
        """Tell whether code for some effects is worth having; the cache may have kept it.

        It would have taken all steps in which no others acted, and will take such steps again.
        """
        own = self._used[known]
        if kept:
            return own >= WORTH_LOADING
        worth = WORTH_COMPILING if has_parts(self._kernel) else WORTH_COMPILING_ALL
        # other threads count as well
        taken = sum(steps for acting, steps in list(self._used.items())
                    if acting <= known and acting not in self._made)  # fmt: skip
        return own >= OWN_PART * worth and taken >= worth

    def _tick(self, known: frozenset[str]) -> Tick:
        """Return an integration that knows some effects; that of all while another one is made."""
        made = self._made.get(known)
        if made is None and self._making.acquire(blocking=False):
            try:
                made = self._made[known] = self._compiled(known)
            finally:
                self._making.release()
        return made or self.whole

    def _compiled(self, known: frozenset[str]) -> Tick:
        whole, acting = self._kernel, [e for e in self._kernel.effects if e.name in known]
        tick = FunctionValue(build_acting(whole, acting, self._cache), TICK)
        if folder := self._folder():
            names = " ".join(sorted(known))
            with suppress(OSError):
                file = folder / f"{hashlib.sha256(names.encode()).hexdigest()[:16]}.acting"
                file.write_text(names)
        return tick

    def _kept(self) -> Iterator[frozenset[str]]:
        """Yield the effects of which there is code in the cache."""
        if folder := self._folder():
            for file in folder.glob("*.acting"):
                yield frozenset(file.read_text().split())

    def _folder(self) -> Path | None:
        """Return the folder that tells what was compiled for this model."""
        if self._cache is None:
            return None
        own = hashlib.sha256(self._kernel.source.encode()).hexdigest()[:8]
        folder = self._cache / sources_digest(self._kernel.effects) / f"acting_{own}"
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
        return folder
