"""Greedy search with joint refits, re-examination and a gate in front of every name."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hil_emulator.identify import gate
from hil_emulator.identify.blocks import BlockScore, score_blocks
from hil_emulator.identify.experiment import Array, Experiment
from hil_emulator.identify.fit import Fit, Fitter
from hil_emulator.identify.predictor import Predictor
from hil_emulator.identify.scan import Projection, Score, scan
from hil_emulator.identify.twin import Coordinate

REFITTED = 4
"""Candidates that are refitted together with everything else."""

REFITS = 5
"""Iterations of a joint refit."""

PROMISING = 0.2
"""Part of the best rough gain below which a candidate is not refitted to the end (assumed)."""

SEVERAL = 5
"""Most effects that are looked for."""

CONTENDERS = 0.75
"""Effects that gain at least this part of the best one are judged by held-out data (assumed)."""

NEAR = 0.9
"""Of effects that gain at least this part of the best on held-out data, the one with the fewest
assumed shape parameters is named (assumed)."""

OUT_EXPLAINED = 1.10
"""A block that explains this much more than the best effect says that its law is another one."""

NOTICEABLE = 0.005
"""Share of the innovations' variance below which an unexplained term is not worth a word: ripple
of friction and supply, which every machine has, is there and significant (assumed)."""

UNKNOWN = 1.6
"""And this much more: that the effect is not in the catalogue (assumed, between the two)."""


@dataclass
class Trial:
    """One candidate, refitted."""

    score: Score
    fit: Fit
    evidence: gate.Evidence
    deviation: float


@dataclass
class Round:
    """One pass over the catalogue."""

    base: Fit
    scores: list[Score]
    trials: list[Trial]
    blocks: list[BlockScore]
    accepted: bool = False
    form_differs: bool = False
    unknown: bool = False


@dataclass
class Search:
    """Where a search stands: rounds so far, and the effects in the model."""

    nuisances: list[Coordinate]
    effects: list[Coordinate] = field(default_factory=list)
    at: Array = field(default_factory=lambda: np.zeros(0))
    rounds: list[Round] = field(default_factory=list)
    form_differs: set[str] = field(default_factory=set)
    final: Fit | None = None


class Searcher:
    """Runs a search.

    Args:
        predictor: computes innovations.
        training: experiments for the fit.
        validation: experiments for the gate.
        candidates: effects that may be named.
        nuisances: ordinary parameters.
        jobs: threads.
        tell: takes progress in words.

    """

    def __init__(
        self, predictor: Predictor, training: Sequence[Experiment],
        validation: Sequence[Experiment], candidates: Sequence[Coordinate],
        nuisances: Sequence[Coordinate], jobs: int = 1,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:  # fmt: skip
        self.predictor = predictor
        self.fitter = Fitter(predictor, training, jobs)
        self.validation = list(validation)
        self.candidates = list(candidates)
        self.nuisances = list(nuisances)
        self.tell = tell
        self._search = Search(self.nuisances)

    def stopped(self) -> Search:
        """Return a search that was interrupted, with the effects that were accepted and fitted."""
        search = self._search
        if search.rounds and search.rounds[-1].accepted:
            fitted = [c.name for c in search.final.coordinates] if search.final else []
            if any(c.name not in fitted for c in search.effects):
                search.final = search.rounds[-1].trials[0].fit
                fitted = [c.name for c in search.final.coordinates]
            search.effects = [c for c in search.effects if c.name in fitted]
        return search

    def run(self) -> Search:
        """Search until nothing more is justified."""
        self._search = search = Search(self.nuisances)
        search.at = np.zeros(len(search.nuisances))
        while len(search.effects) < SEVERAL:
            found = self._round(search)
            search.rounds.append(found)
            if not found.accepted:
                break
            best = found.trials[0]
            search.effects.append(best.score.coordinate)
            search.at = best.fit.at
            if found.form_differs:
                search.form_differs.add(best.score.coordinate.name)
            self._re_examine(search)
        return search

    def look(self) -> Search:
        """Make the first round alone, and accept nothing."""
        search = Search(self.nuisances)
        search.at = np.zeros(len(search.nuisances))
        first = self._round(search)
        first.accepted = False
        least = NOTICEABLE * len(first.base.residual)
        first.unknown = any(b.significant and b.statistic > least for b in first.blocks)
        search.rounds.append(first)
        return search

    def settle(self, search: Search, passes: int = 3) -> Fit:
        """Refit everything in the model, with gains refreshed."""
        free = [*search.nuisances, *search.effects]
        for _ in range(passes):
            self.fitter.freeze(free, search.at)
            fit = self.fitter.fit(free, search.at, 2)
            moved = float(np.max(np.abs(fit.at - search.at), initial=0.0))
            search.at = fit.at
            if moved < 0.05:
                break
        self.fitter.freeze(free, search.at)
        fit = self.fitter.fit(free, search.at, 1)
        search.at = fit.at
        search.final = fit
        return fit

    def _round(self, search: Search) -> Round:
        self.tell(f"refitting {len(search.nuisances)} ordinary parameters")
        base = self.settle(search, 3)
        names = {c.name for c in search.effects}
        rest = [c for c in self.candidates if c.name not in names]
        self.tell(f"screening {len(rest)} effects")
        scores = scan(self.fitter, base, rest)
        held = self._held_out(base)
        likely = [s for s in scores if s.statistic > 4.0 and s.sensible]
        trials = self._trials(base, likely[:REFITTED], held)
        trials = ranked(trials)
        self.tell("looking for what no effect explains")
        project = Projection(base)
        blocks = score_blocks(self.fitter, base.coordinates, base.at, project, project.residual)
        found = Round(base, scores, trials, blocks)
        self._judge(found)
        return found

    def _judge(self, found: Round) -> None:
        least = NOTICEABLE * len(found.base.residual)
        found.blocks.sort(key=lambda b: not (b.significant and b.statistic > least))
        strongest = next((b for b in found.blocks if b.significant and b.statistic > least), None)
        best = found.trials[0] if found.trials else None
        if best is None or not best.evidence.passed:
            found.unknown = strongest is not None
            return
        found.accepted = True
        if strongest is None:
            return
        ratio = (
            max(b.statistic for b in found.blocks if b.significant) - 15.0
        ) / best.evidence.gain
        found.form_differs = ratio > OUT_EXPLAINED
        found.unknown = ratio > UNKNOWN
        found.accepted = not found.unknown

    def _trials(self, base: Fit, likely: list[Score], held: Sequence[Any]) -> list[Trial]:
        """Refit the likeliest candidates: all roughly, the better ones to the end."""
        rough = [self._rough(base, score) for score in likely]
        needed = gate.needed_gain(len(base.residual))
        best = max((base.chi2 - fit.chi2 for fit in rough), default=0.0)
        level = max(needed, PROMISING * best)
        fits = [
            self.fitter.fit(f.coordinates, f.at, REFITS) if base.chi2 - f.chi2 > level else f
            for f in rough
        ]
        return [self._weighed(base, s, f, held) for s, f in zip(likely, fits, strict=True)]

    def _rough(self, base: Fit, score: Score) -> Fit:
        free = [*base.coordinates, score.coordinate]
        at = np.append(base.at, 0.0)
        column = self.fitter.column(free, at, base.residual, len(base.at))
        return self.fitter.fit(free, at, 2, jacobian=np.column_stack([base.jacobian, column]))

    def _weighed(self, base: Fit, score: Score, fit: Fit, held: Sequence[Any]) -> Trial:
        free = fit.coordinates
        gain = base.chi2 - fit.chi2
        slope = fit.jacobian[:, :-1]
        project = Projection(Fit(base.coordinates, fit.at[:-1], fit.residual, slope, 0.0))
        fresh = self.fitter.column(free, fit.at, fit.residual, len(base.at))
        projected = project(fresh)[: len(fit.residual)]
        variance = gate.robust_variance(projected, fit.residual, self.fitter.stretch)
        wald = float(fit.at[-1] ** 2 / variance)
        held_out = float("nan")
        if held:
            before = self.fitter.residual(base.coordinates, base.at, held)
            after = self.fitter.residual(free, fit.at, held)
            held_out = float(before @ before - after @ after)
        needed = gate.needed_gain(len(fit.residual))
        evidence = gate.Evidence(gain, wald, held_out, needed)
        return Trial(score, fit, evidence, float(np.sqrt(variance)))

    def _held_out(self, base: Fit) -> list[Any]:
        par, chan = self.predictor.twin.memory(base.coordinates, base.at)
        held = [self.predictor.freeze(e, par, chan) for e in self.validation]
        for frozen in held:
            self.predictor.weigh(frozen, par, chan)
        return held

    def _re_examine(self, search: Search) -> None:
        """Drop an earlier effect that a later one has made superfluous."""
        if len(search.effects) < 2:
            return
        full = self.settle(search, 1)
        for coordinate in list(search.effects[:-1]):
            i = [c.name for c in full.coordinates].index(coordinate.name)
            rest = [c for c in full.coordinates if c is not coordinate]
            without = self.fitter.fit(
                rest, np.delete(full.at, i), 2, jacobian=np.delete(full.jacobian, i, axis=1)
            )
            if without.chi2 - full.chi2 < gate.needed_gain(len(full.residual)):
                search.effects.remove(coordinate)
                search.at = without.at
                self.tell(f"{coordinate.name} is no longer needed")
                return


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the candidates in the order of what they explain.

    Where several explain the training data about equally well, held-out data decide: a law that
    holds elsewhere beats one that bends to its data.
    """
    by_gain = sorted(trials, key=lambda t: -t.evidence.gain)
    if not by_gain:
        return by_gain
    level = CONTENDERS * by_gain[0].evidence.gain
    contenders = [t for t in by_gain if t.evidence.gain >= level]
    if all(np.isfinite(t.evidence.held_out) for t in contenders):
        contenders.sort(key=lambda t: -t.evidence.held_out)
        near = NEAR * contenders[0].evidence.held_out
        equals = [t for t in contenders if t.evidence.held_out >= near]
        equals.sort(key=lambda t: _assumed(t.score.coordinate))
        contenders = equals + [t for t in contenders if t.evidence.held_out < near]
    return contenders + [t for t in by_gain if t.evidence.gain < level]


def _assumed(coordinate: Coordinate) -> int:
    """Return how many shape parameters of an effect are taken on trust."""
    return len(coordinate.effect.shape) if coordinate.effect else 0
