"""Greedy forward selection of effects with joint refits, acceptance tests and backward steps."""

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
from hil_emulator.identify.prediction.plant.parameters import MOST_USUAL, is_usual
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
"""Number of candidates of a round that are refitted jointly with the model."""

MOST_EFFECTS = 5
"""Largest number of effects that are named."""

REWEIGHTED_ITERATIONS = 5
"""Iterations of a fit after the noise was estimated again."""

BETTER_BASES = 3
"""Largest number of repetitions of a round from a better fit without candidates."""

RETURN_ITERATIONS = 3
"""Iterations of a fit after a candidate was removed from it again."""

KEPT_TERMS = 2
"""Terms per balance whose columns the first round keeps, for maps of the disagreement."""


class Searcher:
    """Search of missing effects.

    Args:
        predictor: computes innovations.
        training: experiments for the fit.
        validation: experiments for the acceptance test.
        candidates: effects that may be named.
        nuisances: ordinary parameters.
        pool: predicts the experiments; None for this thread.
        report: receives progress as text.

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
        self._all_candidates = list(candidates)
        self.nuisances = list(nuisances)
        self.report = report
        self._large: dict[str, Coordinate] = {}
        self._search = Search(self.nuisances)

    def stopped(self) -> Search:
        """Return the state of an interrupted search, with a fit of all accepted effects."""
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
        """Search until no further effect is accepted."""
        search = self._begin()
        while True:
            self.report(f"refitting {len(search.free)} parameters")
            base = self._converged(search)
            if search.effects and negligible_likelihood_gain(search, base):
                name = search.effects[-1].name
                why = "named, but the likelihood is hardly larger with it"
                self._take_out(search, name, why, search.rounds[-1].base)
                break
            current = self._evaluate_round(search, base)
            search.rounds.append(current)
            judge(search, current)
            for _ in range(BETTER_BASES):
                better = self._better_base(search, current)
                if better is None:
                    break
                search.rounds[-1] = self._evaluate_round(search, better)
                current = search.rounds[-1]
                judge(search, current)
            if not current.accepted:
                self._refit_independent(search, current)
            current = self._with_reestimated_noise(search, current)
            if current.accepted and self._usual_after_all(search, current):
                search.rounds.pop()
                continue
            if current.accepted:
                self._accept(search, current)
            current.slim()
            if not current.accepted:
                break
            drop_superfluous(self.fitter, search, self.report)
        self._conclude(search)
        return search

    def _accept(self, search: Search, current: Round) -> None:
        """Add the best candidate of a round to the model."""
        named = current.trials[0]
        current.indistinguishable, current.separating_size = rivals_of(
            named, current.scores, current.trials, self.fitter.clusters, current.excerpt
        )
        search.add(named)
        current.thin(KEPT_TERMS if current is search.rounds[0] else 0)

    def look(self) -> Search:
        """Score free terms only, without any effect of the catalogue."""
        search = self._begin()
        self.report(f"refitting {len(search.free)} parameters")
        base = self._converged(search)
        self.report("scoring the balances")
        current = Round(base, [], [], self._terms(base))
        search.rounds.append(current)
        # the same criterion as at the end of a search
        terms = Discrepancies(self.fitter, base, [], None) if current.noticeable else None
        current.unknown = terms is not None and bool(terms.unknown())
        search.unexplained = current.strongest
        return search

    def _begin(self) -> Search:
        self.report("choosing starting values")
        self._search = Search(self.nuisances)
        self._search.at = coarse_start(self.fitter, self.nuisances)
        if any(map(is_usual, self.nuisances)) and self._released(self._converged(self._search)):
            return self._begin()
        return self._search

    def _released(self, base: Fit) -> bool:
        """Make usual effects that are larger than usual candidates; return whether there are any.

        Args:
            base: fit of the ordinary parameters.

        """
        named = {c.name for c in self._all_candidates}
        large = {c.name: c for c, at in zip(base.coordinates, base.at, strict=True)
                 if is_usual(c) and at > MOST_USUAL and c.name in named}  # fmt: skip
        self._large |= large
        self.nuisances = [c for c in self.nuisances if c.name not in large]
        return bool(large)

    def _usual_after_all(self, search: Search, current: Round) -> bool:
        """Return whether the best candidate is an effect that seemed larger than usual, and is not.

        With the effects in the model that had made it seem so, it becomes an ordinary parameter.
        """
        fit = current.trials[0].fit
        knob, usual = fit.coordinates[-1], self._large.get(fit.coordinates[-1].name)
        if usual is None or usual.at(size := knob.value(float(fit.at[-1]))) > MOST_USUAL:
            return False
        search.at = np.insert(search.at, len(search.nuisances), usual.at(size))
        search.nuisances.append(usual)
        del self._large[usual.name]
        return True

    @property
    def candidates(self) -> list[Coordinate]:
        """Effects that may be named: those that are no ordinary parameters."""
        ordinary = {c.name for c in self.nuisances}
        return [c for c in self._all_candidates if c.name not in ordinary]

    def _converged(self, search: Search, passes: int = 8) -> Fit:
        """Refit all coordinates of the model and store them."""
        fitter, last = self.fitter, search.final
        return search.continue_from(
            converge(fitter, search.free, search.at, search.effects, passes, last)
        )

    def _better_base(self, search: Search, current: Round) -> Fit | None:
        """Return a better fit of the model without candidates, if there is one near the best trial.

        A better local minimum of the ordinary parameters must not count as a gain of the candidate
        whose refit led to it.
        """
        best = min((t.fit for t in current.trials), key=lambda fit: fit.chi2, default=current.base)
        if current.base.chi2 - best.chi2 < current.needed:
            return None
        ordinary = {c.name for c in current.base.coordinates}
        start = best.without([c.name for c in best.coordinates if c.name not in ordinary])
        fit = self.fitter.fit(
            start.coordinates, start.at, RETURN_ITERATIONS, jacobian=start.jacobian
        )
        if current.base.chi2 - fit.chi2 < current.needed:
            return None
        search.adopt(fit)
        base = self._converged(search)
        if np.isnan(base.deviance) or base.deviance < current.base.deviance:
            return base
        if current.base.frozen is not None:
            self.fitter.freeze(current.base.coordinates, current.base.frozen)
        search.continue_from(current.base)
        return None

    def _refit_independent(self, search: Search, current: Round) -> None:
        """Refit candidates that are independent of named laws, and judge the round again."""
        likely = untried_independent(search, current)
        if not likely:
            return
        self.report(f"refitting {len(likely)} effects that are independent of named ones")
        base = current.base
        refits = CandidateRefits(self.fitter, base, self._held_out(base), current.needed)
        current.trials += refits.refit([rescored(self.fitter, base, s) for s in likely])
        judge(search, current)

    def _evaluate_round(self, search: Search, base: Fit, best: Fit | None = None) -> Round:
        """Return a round: candidates and free terms scored at a fit, the likeliest refitted.

        Args:
            search: with the effects in the model.
            base: fit of the model.
            best: fit with a candidate, whose noise weights the held-out data; None for the base's.

        """
        names = {c.name for c in search.effects}
        rest = [c for c in self.candidates if c.name not in names]
        if len(names) == MOST_EFFECTS:
            rest = []
        self.report(f"screening {len(rest)} effects")
        excerpt = excerpt_of(self.fitter, base)
        scores, trials = self._screened(search, base, excerpt, rest, best)
        self.report("scoring free terms")
        # without a named effect, columns are needed for plots only
        terms = self._terms(base, None if names else KEPT_TERMS)
        return Round(base, scores, trials, terms, excerpt=excerpt)

    def _with_reestimated_noise(self, search: Search, current: Round) -> Round:
        """Repeat a round with the noise that is left with its likeliest candidate.

        The repeated round replaces the first one if its candidate is accepted.
        """
        noisy = self.fitter.batch
        likely = [t.score for t in current.trials] or current.scores
        best = reweigh_by_best(self.fitter, current.base, likely)
        if best is None:
            return current
        base = self.fitter.fit(current.base.coordinates, current.base.at, REWEIGHTED_ITERATIONS)
        search.rounds[-1] = again = self._evaluate_round(search, base, best)
        judge(search, again)
        if again.accepted and significant_with_estimated_noise(again):
            return again
        self.fitter.batch, search.rounds[-1] = noisy, current
        judge(search, current)
        return current

    def _screened(
        self, search: Search, base: Fit, excerpt: Excerpt, rest: Sequence[Coordinate],
        best: Fit | None = None,
    ) -> tuple[list[Score], list[Trial]]:  # fmt: skip
        """Return scores of all candidates on an excerpt, and trials of the best on all data."""
        scores = scan(excerpt.fitter, excerpt.fit, rest)
        check = NonlinearCheck(excerpt.fitter, excerpt.fit)
        likely = check.best(scores, REFITTED)
        if highly_implausible_parameters(base):
            likely = check.masked_by_nuisance(scores, likely, REFITTED)
        scores, pairs = [s.lean() for s in scores], pairs_of(scores, excerpt.fit)
        likely = [rescored(self.fitter, base, s) for s in likely]
        held = self._held_out(base, best)
        needed = needed_delta_chi2(len(scores))
        trials = CandidateRefits(self.fitter, base, held, needed).refit(likely)
        alone = max((t.evidence.delta_chi2 for t in trials), default=0.0)
        first = PairSearch(self.fitter, base, held, needed).first_of_pair(pairs, alone)
        if first is not None:
            first = replace(first, score=rescored(self.fitter, base, first.score).lean())
            others = [t for t in trials if t.score.coordinate != first.score.coordinate]
            trials = [first, *others]
        nearest_fit = min(trials, key=lambda t: t.fit.chi2, default=None)
        for trial in trials:
            if trial is not nearest_fit and not trial.evidence.passed:
                trial.slim()
        return scores, trials

    def _terms(self, base: Fit, kept: int | None = None) -> list[DiscrepancyTerm]:
        """Return nonparametric terms, the noticeable ones first."""
        terms = self._scored(base, kept=kept)
        noticeable = {t.title for t in Round(base, [], [], terms).noticeable}
        return sorted(terms, key=lambda t: t.title not in noticeable)

    def _scored(
        self, base: Fit, only: Sequence[str] | None = None, kept: int | None = None
    ) -> list[DiscrepancyTerm]:
        """Return nonparametric terms, all or those of some titles, the most significant first."""
        project = Projection(base)
        return score_terms(self.fitter, base.coordinates, base.at, project, only=only, kept=kept)

    def _conclude(self, search: Search) -> None:
        """Test the laws of the named effects, remove weak effects, find unexplained terms."""
        held = partial(self._held_out, search.rounds[-1].base)
        search.completions = mixed_laws(self.fitter, search, held)
        discrepancies = self._assess_discrepancies(search)
        for name in weak_effects(search):
            self.report(f"{name} is too weak")
            why = "named, but too weak for its uncertain law or value"
            self._take_out(search, name, why)
            discrepancies = self._assess_discrepancies(search)
        last = search.rounds[-1]
        titles = [shape.title for shape in discrepancies.unknown()]
        if titles:
            search.unexplained = self._scored(last.base, titles)
            search.nearest = nearest(search.unexplained[0], last.scores)
        elif not search.effects and highly_implausible_parameters(last.base):
            search.nearest = self._masked_effect(last.base)

    def _masked_effect(self, fit: Fit) -> str:
        """Return the best effect with implausible parameters reset, or "" if not significant."""
        excerpt = excerpt_of(self.fitter, fit)
        reset = as_configured(excerpt.fitter, excerpt.fit)
        scores = scan(excerpt.fitter, reset, self.candidates) if reset else []
        needed = needed_delta_chi2(len(scores))
        return next((s.coordinate.name for s in scores if s.statistic > needed), "")

    def _assess_discrepancies(self, search: Search) -> Discrepancies:
        """Compare the model with added free terms, and enter the lack of fit of named laws."""
        base, terms = search.rounds[-1].base, search.rounds[-1].terms
        self.report("comparing the model with added free terms")
        held = self._held_out(base)
        validation = self.fitter.linearised(base, held) if held is not None else None
        discrepancies = Discrepancies(self.fitter, base, search.effects, validation)
        search.reported_model = report_model(self.fitter, base, validation, terms)
        names = {c.name for c in search.effects}
        completed = {name: str(c) for name, c in search.completions.items()
                     if name in names and c.part > LAW_TOLERANCE}  # fmt: skip
        displaced = displacing(search.effects, base)
        unequal = heterogeneous_estimates(search.effects, search.reported_model)
        remainders = rejected_in_place(search)
        rejected = {name: str(remainder) for name, remainder in remainders.items()}
        search.law_mismatch = {
            **rejected,
            **unequal,
            **displaced,
            **completed,
            **discrepancies.other_laws(),
        }
        search.lack_of_fit = {
            name: max(part, remainders[name].part if name in remainders else 0.0)
            for name, part in discrepancies.lack_of_fit.items()
        }
        return discrepancies

    def _take_out(self, search: Search, name: str, why: str, before: Fit | None = None) -> None:
        """Remove an effect at the end of a search, and score free terms without it.

        Args:
            search: with the effect.
            name: of the effect.
            why: reason in words.
            before: fit to start from; None for the present one.

        """
        score, last = search.selected_in(name).trials[0].score, search.rounds[-1]
        search.remove(name, why)
        if before is not None:
            search.continue_from(before)
        base = self._converged(search, 2)
        # the removed effect may be the nearest to the residual
        search.rounds.append(Round(base, [score, *last.scores], [], self._terms(base)))

    def _held_out(self, base: Fit, best: Fit | None = None) -> Batch | None:
        if not self.validation:
            return None
        held = self.fitter.frozen_at(self.validation, base.coordinates, base.at)
        return held if best is None else held_out(self.fitter, held, best)
