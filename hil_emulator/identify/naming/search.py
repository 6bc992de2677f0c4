"""Greedy search with joint refits, re-examination and a gate in front of every name."""

from collections.abc import Callable, Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.naming import gate
from hil_emulator.identify.naming.blocks import BlockScore, score_blocks
from hil_emulator.identify.naming.confirm import Confirmation
from hil_emulator.identify.naming.contest import Contest
from hil_emulator.identify.naming.doubts import outdone, strained
from hil_emulator.identify.naming.fit import Fit, Fitter
from hil_emulator.identify.naming.form import beyond, own_blocks
from hil_emulator.identify.naming.nearest import nearest
from hil_emulator.identify.naming.progress import Round, Search
from hil_emulator.identify.naming.scan import Projection, scan
from hil_emulator.identify.prediction.predictor import Predictor
from hil_emulator.identify.prediction.twin import Coordinate

REFITTED = 4
"""Candidates that are refitted together with everything else."""

SEVERAL = 5
"""Most effects that are looked for."""

PARSIMONIOUS = 0.7
"""Part of what a free shape of the law of an effect in the model would gain, that another effect
must gain to be named in its place (assumed)."""

SETTLED = 0.3
"""Change in posterior standard deviations below which a fit has settled (assumed)."""

LITTLE = 0.03
"""Prior standard deviations that are added to them: long recordings leave next to none, and the
filter does not notice (assumed)."""

BESIDE = 0.5
"""Part of its gain that a candidate must have beside a free shape of that law (assumed)."""

OUTSHONE = 3.0
"""How many times as much as the best effect a free term may explain for it to be the one (assumed;
laws of another form stay below two)."""

OTHER_LAW = 2.0
"""The same from which an effect that still leaves something in the end is not the one that acts
(assumed)."""

DIFFERENT = 0.05
"""Part of what the model would lose without an effect that a free shape of its law may still gain
before its form differs (assumed)."""

UNKNOWN = 1.0
"""The same, from which on the effect is not the one that acts (assumed)."""


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
        self._outdone: dict[str, float] = {}

    def stopped(self) -> Search:
        """Return a search that was interrupted, with the effects that were accepted and fitted."""
        search = self._search
        fitted = [c.name for c in search.final.coordinates] if search.final else []
        if search.rounds and any(c.name not in fitted for c in search.free):
            last = search.rounds[-1].trials[0].fit
            names = [c.name for c in last.coordinates]
            order = [names.index(c.name) for c in search.free]
            slope = last.jacobian[:, order]
            search.final = Fit(search.free, last.at[order], last.residual, slope, last.chi2)
        return search

    def run(self) -> Search:
        """Search until nothing more is justified."""
        search = self._begin()
        while True:
            found = self._round(search)
            search.rounds.append(found)
            self._judge(search, found)
            found.slim()
            if not found.accepted:
                break
            times, doubt = outdone(found.trials[0], found)
            search.add(found.trials[0])
            if doubt:
                search.forms[search.effects[-1].name] = doubt
                self._outdone[search.effects[-1].name] = times
            self._re_examine(search)
        self._conclude(search)
        return search

    def look(self) -> Search:
        """Look for terms alone: no effect is screened, and none accepted."""
        search = self._begin()
        self.tell(f"refitting {len(search.free)} parameters")
        base = self.settle(search)
        self.tell("looking for balances that disagree")
        found = Round(base, [], [], self._blocks(base))
        found.unknown = bool(found.worthwhile)
        search.rounds.append(found)
        return search

    def _begin(self) -> Search:
        self._search = Search(self.nuisances)
        self._search.at = np.zeros(len(self.nuisances))
        self._outdone.clear()
        return self._search

    def settle(self, search: Search, passes: int = 8) -> Fit:
        """Refit everything in the model, with gains refreshed, until it hardly moves.

        Slopes are kept from one pass to the next; it has settled when fresh ones hardly move it.
        """
        nudging = bool(search.effects)
        slope = None
        for _ in range(passes):
            self.fitter.freeze(search.free, search.at)
            fit = self.fitter.fit(search.free, search.at, 2, jacobian=slope)
            priors = np.array([c.prior if np.isfinite(c.prior) else 0.0 for c in search.free])
            spread = np.sqrt(np.diag(fit.covariance()) + (LITTLE * priors) ** 2 + 1e-30)
            settled = float(np.max(np.abs(fit.at - search.at) / spread, initial=0.0)) < SETTLED
            search.at = fit.at
            if settled and slope is None and not nudging:
                break
            if settled and slope is None:
                nudging = False
                search.at = self._nudged(search, fit).at
            else:
                slope = None if settled else fit.jacobian
        search.final = fit
        return fit

    def _nudged(self, search: Search, fit: Fit) -> Fit:
        for effect in search.effects:
            fit = self.fitter.nudged(fit, search.free.index(effect))
        return fit

    def _round(self, search: Search) -> Round:
        self.tell(f"refitting {len(search.free)} parameters")
        base = self.settle(search)
        names = {c.name for c in search.effects}
        rest = [c for c in self.candidates if c.name not in names]
        if len(names) == SEVERAL:
            rest = []
        self.tell(f"screening {len(rest)} effects")
        scores = scan(self.fitter, base, rest)
        sensible = [s for s in scores if s.sensible]
        likely = Confirmation(self.fitter, base).best(sensible, REFITTED)
        trials = Contest(self.fitter, base, self._held_out(base)).enter(likely)
        self.tell("looking for what no effect explains")
        return Round(base, scores, trials, self._blocks(base))

    def _blocks(self, base: Fit) -> list[BlockScore]:
        """Return nonparametric terms, those that are worth a word first."""
        project = Projection(base)
        blocks = score_blocks(self.fitter, base.coordinates, base.at, project, project.residual)
        worthwhile = {b.title for b in Round(base, [], [], blocks).worthwhile}
        return sorted(blocks, key=lambda b: b.title not in worthwhile)

    def _judge(self, search: Search, found: Round) -> None:
        """Accept the best candidate, or say that none is justified.

        Where a free term explains far more, none is. Where the law of an effect in the model
        explains what remains better than any candidate does, only a candidate that gains beside a
        free shape of that law is accepted.
        """
        best = found.trials[0].evidence.gain if found.trials else 0.0
        owners = own_blocks(found.base, [c.name for c in search.effects], found.significant)
        own = [b for b in found.significant if b.title in owners]
        if any(b.surplus > OUTSHONE * best for b in found.worthwhile):
            found.accepted = False
        elif any(best < PARSIMONIOUS * b.surplus or _of_one_sensor(found, b) for b in own):
            gains = {t.score.coordinate.name: beyond(t.score, own, found.base)
                     for t in found.trials}  # fmt: skip
            least = gate.needed_gain(len(found.base.residual))
            beside = [
                t for t in found.trials
                if gains[t.score.coordinate.name] > max(least, BESIDE * t.score.statistic)
            ]  # fmt: skip
            found.trials.sort(key=lambda t: t not in beside)
            found.accepted = bool(beside) and beside[0].evidence.passed
        else:
            found.accepted = bool(found.trials) and found.trials[0].evidence.passed
        found.unknown = not found.accepted and any(b.title not in owners for b in found.worthwhile)

    def _conclude(self, search: Search) -> None:
        """Say of each effect in the model whether its law fits what it was named for."""
        last = search.rounds[-1]
        names = [c.name for c in search.effects]
        owners = own_blocks(last.base, names, last.significant)
        strains = strained(last.base, names)
        for name in names:
            own = [b for b in last.significant if owners.get(b.title) == name]
            block = max(own, key=lambda b: b.statistic, default=None)
            left = block.surplus if block else 0.0
            standing = self._standing(last.base, name) if block else 0.0
            differs = block is not None and left > DIFFERENT * standing
            outshone = self._outdone.get(name, 1.0) > OTHER_LAW
            if left > UNKNOWN * standing or (differs and outshone):
                self._reject(search, name)
            elif block and differs:
                part = 100.0 * left / (left + standing)
                search.forms[name] = f"a free term in the {block.title} explains {part:.0f} % more"
            elif name in strains:
                search.forms.setdefault(name, strains[name])
        last = search.rounds[-1]
        if last.unknown:
            search.nearest = nearest(last.worthwhile[0], last.scores) if last.worthwhile else ""

    def _standing(self, fit: Fit, name: str) -> float:
        """Return what the model loses in chi-square without one of its effects."""
        kept = {c.name for c in self._search.without(name)}
        stay = [i for i, c in enumerate(fit.coordinates) if c.name in kept]
        rest = [fit.coordinates[i] for i in stay]
        without = self.fitter.fit(rest, fit.at[stay], 3, jacobian=fit.jacobian[:, stay])
        return without.chi2 - fit.chi2

    def _reject(self, search: Search, name: str) -> None:
        """Take out an effect that leaves most of what it was named for."""
        self.tell(f"{name} does not explain it")
        search.remove(name)
        base = self.settle(search, 2)
        last = search.rounds[-1]
        search.rounds.append(Round(base, last.scores, [], self._blocks(base), unknown=True))

    def _held_out(self, base: Fit) -> list[object]:
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
        for name in [c.name for c in search.effects[:-1]]:
            kept = {c.name for c in search.without(name)}
            stay = [i for i, c in enumerate(full.coordinates) if c.name in kept]
            rest = [full.coordinates[i] for i in stay]
            fit = self.fitter.fit(rest, full.at[stay], 2, jacobian=full.jacobian[:, stay])
            if fit.chi2 - full.chi2 < gate.needed_gain(len(full.residual)):
                search.remove(name)
                search.adopt(fit)
                self.tell(f"{name} is no longer needed")
                return


def _of_one_sensor(found: Round, block: BlockScore) -> bool:
    """Tell whether the best candidate is another error of the sensor that a term is about."""
    channel = found.trials[0].score.coordinate.channel if found.trials else ""
    return bool(channel) and channel == block.balance.channel
