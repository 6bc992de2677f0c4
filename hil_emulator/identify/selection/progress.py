"""State of a search: its rounds, and the effects in the model."""

from dataclasses import dataclass, field, replace

import numpy as np

from hil_emulator.identify.estimation.excerpt import Excerpt
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, leading
from hil_emulator.identify.estimation.reported_model import ReportedModel
from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Trial
from hil_emulator.identify.selection.levels import NOTICEABLE, needed_delta_chi2
from hil_emulator.identify.selection.scan import Score

MOST_SHOWN = 3
"""Largest number of unexplained terms in a report."""

RivalStart = tuple[list[Coordinate], Array]
"""Coordinates that a rival adds to a model, its knob last, and their starting values."""


@dataclass
class Round:
    """One pass over the catalogue.

    Attributes:
        base: fit without any of the candidates.
        scores: of all candidates, best first.
        trials: joint refits of the likeliest candidates, best first.
        terms: nonparametric terms, the noticeable ones first.
        accepted: whether the effect of the first trial was added to the model.
        unknown: whether a noticeable residual belongs to no effect.
        indistinguishable: effects that these data do not separate from the accepted effect, the
            nearest first.
        separating_size: size of the accepted effect at which these data would separate it from
            the nearest rival; None without a rival.
        near_rivals: effects that explain nearly as much in the final model, the best first.
        excerpt: data on which the candidates were scored; None for all training data.
        rows: indices of the residuals for which the terms' columns are stored; None for all.
        part: `base` at these residuals; None for all.

    """

    base: Fit
    scores: list[Score]
    trials: list[Trial]
    terms: list[DiscrepancyTerm]
    accepted: bool = False
    unknown: bool = False
    indistinguishable: list[str] = field(default_factory=list)
    separating_size: float | None = None
    near_rivals: dict[str, RivalStart] = field(default_factory=dict)
    excerpt: Excerpt | None = None
    rows: Index | None = None
    part: Fit | None = None

    def slim(self) -> None:
        """Delete the candidates' sensitivities, which are large for long recordings."""
        self.scores = [replace(s, column=np.zeros(0)) for s in self.scores]
        self.excerpt = None
        for trial in self.trials[1:] if self.accepted else self.trials:
            trial.slim()
        if not self.accepted:
            reported = {t.title for t in (*self.noticeable, *self.strongest, *self._plotted)}
            self.terms = [t if t.title in reported else t.lean() for t in self.terms]

    def thin(self, kept: int) -> None:
        """Delete the columns of all terms but the strongest of each balance.

        The remaining columns and the base's Jacobian are stored for the excerpt only.

        Args:
            kept: number of terms of each balance whose columns are kept.

        """
        strongest = leading(self.terms, kept)
        for i, term in enumerate(self.terms):
            if term.title not in strongest:
                self.terms[i] = term.lean()
            elif self.excerpt is not None and term.columns.size:
                columns = self.excerpt.columns(term.columns).astype(np.float32)
                self.terms[i] = replace(term, columns=columns)
        if self.excerpt is not None and self.excerpt.rows is not None:
            self.rows, self.part = self.excerpt.rows, self.excerpt.fit
            self.base = replace(self.base, jacobian=np.zeros((0, len(self.base.at))))

    @property
    def columns_fit(self) -> Fit:
        """`base` at the residuals for which the terms' columns are stored."""
        return self.base if self.part is None else self.part

    @property
    def best(self) -> float:
        """Gain in chi-square of the first candidate; 0 without candidates."""
        return self.trials[0].evidence.delta_chi2 if self.trials else 0.0

    @property
    def needed(self) -> float:
        """Gain in chi-square that the best of all candidates must exceed (Bonferroni)."""
        return needed_delta_chi2(len(self.scores))

    @property
    def significant(self) -> list[DiscrepancyTerm]:
        """Statistically significant terms."""
        return [t for t in self.terms if t.significant]

    @property
    def noticeable(self) -> list[DiscrepancyTerm]:
        """Significant terms whose share of the variance is at least `NOTICEABLE`."""
        least = NOTICEABLE * self.base.sample_size
        return [t for t in self.significant if t.surplus > least * len(t.knots) / HATS]

    @property
    def _plotted(self) -> list[DiscrepancyTerm]:
        """Term that is plotted if no term is noticeable: the first one of the machine."""
        return [t for t in self.terms if t.columns.size and not t.balance.channel][:1]

    @property
    def strongest(self) -> list[DiscrepancyTerm]:
        """First significant terms with stored columns, if the residual is unexplained."""
        stored = [t for t in self.terms if t.significant and t.columns.size]
        return stored[:MOST_SHOWN] if self.unknown else []


@dataclass(frozen=True)
class Completion:
    """A rival of a named effect that explains a part of the remaining residual.

    Attributes:
        named: effect in the model.
        rival: effect that explained nearly as much when `named` was accepted.
        part: gain in chi-square of adding the rival to the model, over the gain of `named`.

    """

    named: str
    rival: str
    part: float

    def __str__(self) -> str:
        """Return the reason why the law of `named` is not the catalogue's."""
        return f"{self.rival}, which explains nearly the same, explains {self.part:.0%} more"


@dataclass
class Search:
    """State of a search.

    Attributes:
        nuisances: ordinary parameters.
        shapes: shape parameters of the effects in the model.
        effects: knobs of the effects in the model.
        at: values of all these coordinates, in this order.
        rounds: completed rounds.
        law_mismatch: by effect in the model, the reason why its law is not the catalogue's.
        lack_of_fit: by effect, chi-square that its law leaves unexplained over the chi-square that
            the effect explains.
        completions: by effect in the model, the rival that completes its law.
        dropped: by effect that was named and removed, the reason.
        unexplained: terms that belong to no effect, the strongest first.
        nearest: the effect of the catalogue that is most similar to the unexplained residual, or
            two of them ("fixed_pump or variable_pump"), or "".
        final: the last fit.
        reported_model: `final` with friction ripple integrated out; None during the search.

    """

    nuisances: list[Coordinate]
    shapes: list[Coordinate] = field(default_factory=list)
    effects: list[Coordinate] = field(default_factory=list)
    at: Array = field(default_factory=lambda: np.zeros(0))
    rounds: list[Round] = field(default_factory=list)
    law_mismatch: dict[str, str] = field(default_factory=dict)
    lack_of_fit: dict[str, float] = field(default_factory=dict)
    completions: dict[str, Completion] = field(default_factory=dict)
    dropped: dict[str, str] = field(default_factory=dict)
    unexplained: list[DiscrepancyTerm] = field(default_factory=list)
    nearest: str = ""
    final: Fit | None = None
    reported_model: ReportedModel | None = None

    @property
    def ordinary(self) -> list[Coordinate]:
        """Coordinates that are fitted together with the effects' knobs."""
        return [*self.nuisances, *self.shapes]

    @property
    def selections(self) -> list[list[Trial]]:
        """Trials of the rounds in which the effects in the model were named."""
        names = {c.name for c in self.effects}
        return [r.trials for r in self.rounds
                if r.accepted and r.trials[0].score.coordinate.name in names]  # fmt: skip

    def selected_in(self, name: str) -> Round:
        """Return the last round in which an effect was named."""
        return next(r for r in reversed(self.rounds)
                    if r.accepted and r.trials[0].score.coordinate.name == name)  # fmt: skip

    @property
    def reported(self) -> Fit | None:
        """Fit with the reported values."""
        return self.final if self.reported_model is None else self.reported_model.fit

    @property
    def free(self) -> list[Coordinate]:
        """All coordinates that are fitted."""
        return [*self.ordinary, *self.effects]

    def adopt(self, fit: Fit) -> None:
        """Copy the coordinates of a fit, matched by name."""
        values = {c.name: a for c, a in zip(fit.coordinates, fit.at, strict=True)}
        self.at = np.array([values[c.name] for c in self.free])

    def continue_from(self, fit: Fit) -> Fit:
        """Store a fit of all coordinates as the starting point, and return it."""
        self.final, self.at = fit, fit.at
        return fit

    def add(self, trial: Trial) -> None:
        """Add an effect to the model."""
        present = {c.name for c in self.free}
        self.shapes += [c for c in trial.fit.coordinates[:-1] if c.name not in present]
        self.effects.append(trial.fit.coordinates[-1])
        self.adopt(trial.fit)

    def without(self, name: str) -> list[Coordinate]:
        """Return the coordinates without those of one effect."""
        return [c for c in self.free if not c.belongs_to(name)]

    def remove(self, name: str, why: str) -> None:
        """Remove an effect from the model.

        Args:
            name: of the effect.
            why: reason in words.

        """
        self.dropped[name] = why
        self.reported_model = None
        kept = {c.name for c in self.without(name)}
        values = dict(zip([c.name for c in self.free], self.at, strict=True))
        self.shapes = [c for c in self.shapes if c.name in kept]
        self.effects = [c for c in self.effects if c.name in kept]
        self.at = np.array([values[c.name] for c in self.free])
        if self.final is not None:
            gone = {c.name for c in self.final.coordinates} - kept
            self.final = self.final.without(gone)
        self.law_mismatch.pop(name, None)
        self.completions.pop(name, None)
