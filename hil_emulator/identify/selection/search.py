"""Greedy search with joint refits, an acceptance test before every name, and re-examination."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from hil_emulator.identify.estimation.coarse_search import coarse_start
from hil_emulator.identify.estimation.excerpt import Excerpt, excerpt_of
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.estimation.reported_model import report_model
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import Batch, Pool
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.certainty import (
    drop_superfluous,
    heterogeneous_estimates,
    highly_implausible_parameters,
    negligible_likelihood_gain,
    weak_effects,
)
from hil_emulator.identify.selection.discrepancies import Discrepancies
from hil_emulator.identify.selection.evidence import Trial
from hil_emulator.identify.selection.law_form import (
    displacing,
    judge,
    nearest,
    untried_independent,
)
from hil_emulator.identify.selection.levels import LAW_TOLERANCE, needed_delta_chi2
from hil_emulator.identify.selection.mixed_law import mixed_laws, rejected_in_place
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.refits import (
    CandidateRefits,
    PairSearch,
    held_out,
    reweigh_by_best,
    significant_with_estimated_noise,
)
from hil_emulator.identify.selection.rivals import rivals_of
from hil_emulator.identify.selection.scan import Score, pairs_of, rescored, scan
from hil_emulator.identify.selection.starts import NonlinearCheck, as_configured

REFITTED = 4
"""Candidates that are refitted together with everything else."""

MOST_EFFECTS = 5
"""Most effects that are looked for."""

REWEIGHTED_ITERATIONS = 5
"""Iterations of a fit that begins at one by another noise."""

BETTER_BASES = 3
"""Most times that a round is repeated from a better fit without any candidate."""

RETURN_ITERATIONS = 3
"""Iterations of a fit that goes on without the effect that led there."""

KEPT_TERMS = 2
"""Terms of each balance whose columns are kept of the first round, for the account of the gap."""


class Searcher:
    """Runs a search.

    Args:
        predictor: computes innovations.
        training: experiments for the fit.
        validation: experiments for the acceptance test.
        candidates: effects that may be named.
        nuisances: ordinary parameters.
        pool: where experiments are predicted; without one, in this thread.
        tell: takes progress in words.

    """

    def __init__(
        self, predictor: Predictor, training: Sequence[Experiment],
        validation: Sequence[Experiment], candidates: Sequence[Coordinate],
        nuisances: Sequence[Coordinate], pool: Pool | None = None,
        report: Callable[[str], None] = lambda _: None,
    ) -> None:  # fmt: skip
        self.predictor = predictor
        self.fitter = Fitter(predictor, training, pool)
        self.validation = list(validation)
        self.candidates = list(candidates)
        self.nuisances = list(nuisances)
        self.report = report
        self._search = Search(self.nuisances)

    def stopped(self) -> Search:
        """Return a search that was interrupted, with the effects that were accepted and fitted."""
        search = self._search
        fitted = [c.name for c in search.final.coordinates] if search.final else []
        if search.rounds and any(c.name not in fitted for c in search.free):
            last = search.rounds[-1].trials[0].fit
            names = [c.name for c in last.coordinates]
            order = [names.index(c.name) for c in search.free]
            jacobian = last.jacobian[:, order]
            search.final = Fit(search.free, last.at[order], last.residual, jacobian, last.chi2)
        if search.rounds:
            search.unexplained = search.rounds[-1].strongest
        return search

    def run(self) -> Search:
        """Search until nothing more is justified."""
        search = self._begin()
        while True:
            self.report(f"refitting {len(search.free)} parameters")
            base = self._converged(search)
            if search.effects and negligible_likelihood_gain(search, base):
                name = search.effects[-1].name
                why = "named, but the data are hardly more likely with it"
                self._take_out(search, name, why, search.rounds[-1].base)
                break
            found = self._evaluate_round(search, base)
            search.rounds.append(found)
            judge(search, found)
            for _ in range(BETTER_BASES):
                better = self._better_base(search, found)
                if better is None:
                    break
                search.rounds[-1] = self._evaluate_round(search, better)
                found = search.rounds[-1]
                judge(search, found)
            if not found.accepted:
                self._refit_independent(search, found)
            found = self._with_reestimated_noise(search, found)
            if found.accepted:
                self._accept(search, found)
            found.slim()
            if not found.accepted:
                break
            drop_superfluous(self.fitter, search, self.report)
        self._conclude(search)
        return search

    def _accept(self, search: Search, found: Round) -> None:
        """Take the best candidate of a round into the model."""
        named = found.trials[0]
        found.indistinguishable, found.separating_size = rivals_of(
            named, found.scores, found.trials, self.fitter.clusters, found.excerpt
        )
        search.add(named)
        found.thin(KEPT_TERMS if found is search.rounds[0] else 0)

    def look(self) -> Search:
        """Look for terms alone: no effect is screened, and none accepted."""
        search = self._begin()
        self.report(f"refitting {len(search.free)} parameters")
        base = self._converged(search)
        self.report("looking for balances that disagree")
        found = Round(base, [], [], self._terms(base))
        search.rounds.append(found)
        # by the measure by which a search ends, so that both give one answer
        beside = Discrepancies(self.fitter, base, [], None) if found.noticeable else None
        found.unknown = beside is not None and bool(beside.unknown())
        search.unexplained = found.strongest
        return search

    def _begin(self) -> Search:
        self.report("choosing where the fit begins")
        self._search = Search(self.nuisances)
        self._search.at = np.zeros(len(self.nuisances))
        start = coarse_start(self.fitter, self.nuisances)
        if start.any():
            fits = [converge(self.fitter, self.nuisances, at) for at in (self._search.at, start)]
            self._search.continue_from(min(fits, key=lambda fit: fit.deviance))
        return self._search

    def _converged(self, search: Search, passes: int = 8) -> Fit:
        """Refit everything in the model, and go on from there."""
        fitter, last = self.fitter, search.final
        return search.continue_from(
            converge(fitter, search.free, search.at, search.effects, passes, last)
        )

    def _better_base(self, search: Search, found: Round) -> Fit | None:
        """Return a better fit without any candidate, if the best fit with one has led there.

        What ordinary parameters explain elsewhere is no gain of an effect that moved them there.
        """
        ended = min((t.fit for t in found.trials), key=lambda fit: fit.chi2, default=found.base)
        if found.base.chi2 - ended.chi2 < found.needed:
            return None
        ordinary = {c.name for c in found.base.coordinates}
        start = ended.without([c.name for c in ended.coordinates if c.name not in ordinary])
        fit = self.fitter.fit(
            start.coordinates, start.at, RETURN_ITERATIONS, jacobian=start.jacobian
        )
        if found.base.chi2 - fit.chi2 < found.needed:
            return None
        search.adopt(fit)
        base = self._converged(search)
        if np.isnan(base.deviance) or base.deviance < found.base.deviance:
            return base
        if found.base.frozen is not None:
            self.fitter.freeze(found.base.coordinates, found.base.frozen)
        search.continue_from(found.base)
        return None

    def _refit_independent(self, search: Search, found: Round) -> None:
        """Refit what stands out beside a law that does not fit, and judge the round with it."""
        likely = untried_independent(search, found)
        if not likely:
            return
        self.report(f"refitting {len(likely)} effects beside a law that does not fit")
        base = found.base
        refits = CandidateRefits(self.fitter, base, self._held_out(base), found.needed)
        found.trials += refits.refit([rescored(self.fitter, base, s) for s in likely])
        judge(search, found)

    def _evaluate_round(self, search: Search, base: Fit, best: Fit | None = None) -> Round:
        """Return what candidates and free terms explain that a fit does not."""
        names = {c.name for c in search.effects}
        rest = [c for c in self.candidates if c.name not in names]
        if len(names) == MOST_EFFECTS:
            rest = []
        self.report(f"screening {len(rest)} effects")
        excerpt = excerpt_of(self.fitter, base)
        scores, trials = self._screened(search, base, excerpt, rest, best)
        self.report("looking for what no effect explains")
        # before any is named, there is no law that columns might complete
        terms = self._terms(base, None if names else KEPT_TERMS)
        return Round(base, scores, trials, terms, excerpt=excerpt)

    def _with_reestimated_noise(self, search: Search, found: Round) -> Round:
        """Judge a round again by the noise that its likeliest candidate leaves, if it is named."""
        noisy = self.fitter.batch
        likely = [t.score for t in found.trials] or found.scores
        best = reweigh_by_best(self.fitter, found.base, likely)
        if best is None:
            return found
        base = self.fitter.fit(found.base.coordinates, found.base.at, REWEIGHTED_ITERATIONS)
        search.rounds[-1] = again = self._evaluate_round(search, base, best)
        judge(search, again)
        if again.accepted and significant_with_estimated_noise(again):
            return again
        self.fitter.batch, search.rounds[-1] = noisy, found
        judge(search, found)
        return found

    def _screened(
        self, search: Search, base: Fit, excerpt: Excerpt, rest: Sequence[Coordinate],
        best: Fit | None = None,
    ) -> tuple[list[Score], list[Trial]]:  # fmt: skip
        """Return the score of every candidate in an excerpt, and the likeliest, refitted to all."""
        scores = scan(excerpt.fitter, excerpt.fit, rest)
        look = NonlinearCheck(excerpt.fitter, excerpt.fit)
        likely = look.best(scores, REFITTED)
        if highly_implausible_parameters(base):
            likely = look.masked_by_nuisance(scores, likely, REFITTED)
        scores, pairs = [s.lean() for s in scores], pairs_of(scores, excerpt.fit)
        likely = [rescored(self.fitter, base, s) for s in likely]
        held = self._held_out(base, best)
        needed = needed_delta_chi2(len(scores))
        trials = CandidateRefits(self.fitter, base, held, needed).refit(likely)
        alone = max((t.evidence.delta_chi2 for t in trials), default=0.0)
        ahead = PairSearch(self.fitter, base, held, needed)
        first_of_pair = ahead.first_of_pair(pairs, alone)
        if first_of_pair is not None:
            first_of_pair = replace(
                first_of_pair, score=rescored(self.fitter, base, first_of_pair.score).lean()
            )
            others = [t for t in trials if t.score.coordinate != first_of_pair.score.coordinate]
            trials = [first_of_pair, *others]
        nearest_fit = min(trials, key=lambda t: t.fit.chi2, default=None)
        for trial in trials:
            if trial is not nearest_fit and not trial.evidence.passed:
                trial.slim()
        return scores, trials

    def _terms(self, base: Fit, kept: int | None = None) -> list[DiscrepancyTerm]:
        """Return nonparametric terms, those that are worth a word first."""
        terms = self._scored(base, kept=kept)
        noticeable = {t.title for t in Round(base, [], [], terms).noticeable}
        return sorted(terms, key=lambda t: t.title not in noticeable)

    def _scored(
        self, base: Fit, only: Sequence[str] | None = None, kept: int | None = None
    ) -> list[DiscrepancyTerm]:
        """Return nonparametric terms, all or those of some titles, the strongest first."""
        project = Projection(base)
        return score_terms(self.fitter, base.coordinates, base.at, project, only=only, kept=kept)

    def _conclude(self, search: Search) -> None:
        """Say of each effect whether its law is the catalogue's, and what no effect explains."""
        held = partial(self._held_out, search.rounds[-1].base)
        search.completions = mixed_laws(self.fitter, search, held)
        beside = self._assess_discrepancies(search)
        for name in weak_effects(search):
            self.report(f"{name} is too faint")
            why = "named, but too faint for a law or a value as uncertain as that"
            self._take_out(search, name, why)
            beside = self._assess_discrepancies(search)
        last = search.rounds[-1]
        titles = [shape.title for shape in beside.unknown()]
        if titles:
            search.unexplained = self._scored(last.base, titles)
            search.nearest = nearest(search.unexplained[0], last.scores)
        elif not search.effects and highly_implausible_parameters(last.base):
            search.nearest = self._masked_effect(last.base)

    def _masked_effect(self, fit: Fit) -> str:
        """Return the effect that explains the most where parameters driven far go back."""
        excerpt = excerpt_of(self.fitter, fit)
        there = as_configured(excerpt.fitter, excerpt.fit)
        scores = scan(excerpt.fitter, there, self.candidates) if there else []
        needed = needed_delta_chi2(len(scores))
        return next((s.coordinate.name for s in scores if s.statistic > needed), "")

    def _assess_discrepancies(self, search: Search) -> Discrepancies:
        """Weigh what acts beside the model, and say what that makes of the laws in it."""
        base, terms = search.rounds[-1].base, search.rounds[-1].terms
        self.report("weighing what acts beside the model")
        held = self._held_out(base)
        elsewhere = self.fitter.elsewhere(base, held) if held is not None else None
        beside = Discrepancies(self.fitter, base, search.effects, elsewhere)
        search.reported_model = report_model(self.fitter, base, search.effects, elsewhere, terms)
        names = {c.name for c in search.effects}
        completed = {name: str(c) for name, c in search.completions.items()
                     if name in names and c.part > LAW_TOLERANCE}  # fmt: skip
        displaced = displacing(search.effects, base)
        unequal, left = heterogeneous_estimates(search.reported_model), rejected_in_place(search)
        refused = {name: str(there) for name, there in left.items()}
        search.law_mismatch = {
            **refused,
            **unequal,
            **displaced,
            **completed,
            **beside.other_laws(),
        }
        search.lack_of_fit = {name: max(part, left[name].part if name in left else 0.0)
                        for name, part in beside.lack_of_fit.items()}  # fmt: skip
        return beside

    def _take_out(self, search: Search, name: str, why: str, before: Fit | None = None) -> None:
        """Take an effect out of the model at the end, and look again at what remains.

        What remains may resemble nothing as much as this effect.
        """
        itself, last = search.selected_in(name).trials[0].score, search.rounds[-1]
        search.remove(name, why)
        if before is not None:
            search.continue_from(before)
        base = self._converged(search, 2)
        search.rounds.append(Round(base, [itself, *last.scores], [], self._terms(base)))

    def _held_out(self, base: Fit, best: Fit | None = None) -> Batch | None:
        if not self.validation:
            return None
        held = self.fitter.frozen_at(self.validation, base.coordinates, base.at)
        return held if best is None else held_out(self.fitter, held, best)
