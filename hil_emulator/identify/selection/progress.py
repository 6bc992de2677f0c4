"""Where a search stands: its rounds, and the effects that are in the model."""

from dataclasses import dataclass, field, replace

import numpy as np

from hil_emulator.identify.estimation.excerpt import Excerpt
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, leading
from hil_emulator.identify.estimation.settled import Settled
from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Trial
from hil_emulator.identify.selection.levels import NOTICEABLE, needed_delta_chi2
from hil_emulator.identify.selection.scan import Score

MOST_SHOWN = 3
"""Most terms that are shown of what is unknown."""

StandIn = tuple[list[Coordinate], Array]
"""What a rival brings along into a model, its knob last, and where that ends."""


@dataclass
class Round:
    """One pass over the catalogue.

    Attributes:
        base: the fit before it.
        scores: of all candidates, best first.
        trials: the likeliest, refitted, best first.
        terms: nonparametric terms, the worthwhile ones first.
        accepted: whether the first trial became part of the model.
        unknown: whether something remains that no effect explains.
        alike: effects that the data of the accepted one cannot tell from it, the nearest first.
        separating: size at which the nearest of them would separate; None without any.
        near: rivals that nearly explain as much in the finished model, the best first.
        excerpt: where the candidates were scored, the trials' apart; None for all data.
        rows: which residuals of all data the columns of its terms are kept of; None for all.
        part: the fit before it by these residuals; None for all.

    """

    base: Fit
    scores: list[Score]
    trials: list[Trial]
    terms: list[DiscrepancyTerm]
    accepted: bool = False
    unknown: bool = False
    alike: list[str] = field(default_factory=list)
    separating: float | None = None
    near: dict[str, StandIn] = field(default_factory=dict)
    excerpt: Excerpt | None = None
    rows: Index | None = None
    part: Fit | None = None

    def slim(self) -> None:
        """Forget the candidates' sensitivities: long recordings would fill the memory."""
        self.scores = [replace(s, column=np.zeros(0)) for s in self.scores]
        self.excerpt = None
        for trial in self.trials[1:] if self.accepted else self.trials:
            trial.slim()
        if not self.accepted:
            told = {t.title for t in (*self.worthwhile, *self.strongest, *self._drawn)}
            self.terms = [t if t.title in told else t.lean() for t in self.terms]

    def thin(self, kept: int) -> None:
        """Forget the columns of all terms but the strongest of each balance.

        Those of a long recording, and the base's, are large, and kept of the excerpt only.
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
    def seen(self) -> Fit:
        """The fit before it, by the residuals that the columns of its terms are kept of."""
        return self.base if self.part is None else self.part

    @property
    def best(self) -> float:
        """Gain of the first candidate."""
        return self.trials[0].evidence.delta_chi2 if self.trials else 0.0

    @property
    def needed(self) -> float:
        """Gain in chi-square that a name needs among its candidates."""
        return needed_delta_chi2(len(self.scores))

    @property
    def significant(self) -> list[DiscrepancyTerm]:
        """Terms that are hardly chance."""
        return [t for t in self.terms if t.significant]

    @property
    def worthwhile(self) -> list[DiscrepancyTerm]:
        """Terms that are neither chance nor too small for a word."""
        least = NOTICEABLE * self.base.sample_size
        return [t for t in self.significant if t.surplus > least * len(t.knots) / HATS]

    @property
    def _drawn(self) -> list[DiscrepancyTerm]:
        """What is drawn where nothing is worth a word: the first term that is no sensor's error."""
        return [t for t in self.terms if t.columns.size and not t.balance.channel][:1]

    @property
    def strongest(self) -> list[DiscrepancyTerm]:
        """The first terms whose columns are known, if something unknown remains."""
        known = [t for t in self.terms if t.significant and t.columns.size]
        return known[:MOST_SHOWN] if self.unknown else []


@dataclass(frozen=True)
class Completion:
    """A rival that completes a law.

    Attributes:
        named: the effect in the model.
        rival: what nearly explained the same.
        part: gain of the rival beside it, over its own.

    """

    named: str
    rival: str
    part: float

    def __str__(self) -> str:
        """Say what speaks against the law."""
        return f"{self.rival}, which nearly explains the same, explains {self.part:.0%} more"


@dataclass
class Search:
    """Where a search stands.

    Attributes:
        nuisances: ordinary parameters.
        shapes: what else the laws of the effects in the model hold.
        effects: knobs of the effects in the model.
        at: coordinates of all of them, in this order.
        rounds: so far.
        forms: why the law of an effect in the model is another one than the catalogue's, by name.
        lacks: what its law lacks, as a part of the chi-square that each effect makes, by name.
        between: the rival that only completes the law of an effect in the model, by its name.
        dropped: why an effect that was named is in the model no more, by name.
        unexplained: terms that no effect explains, the strongest first.
        nearest: the catalogued effect that what remains unexplained resembles most, or two of them
            ("fixed_pump or variable_pump"), or "".
        final: the last fit.
        settled: the same as it is told; None as long as it is not finished.

    """

    nuisances: list[Coordinate]
    shapes: list[Coordinate] = field(default_factory=list)
    effects: list[Coordinate] = field(default_factory=list)
    at: Array = field(default_factory=lambda: np.zeros(0))
    rounds: list[Round] = field(default_factory=list)
    forms: dict[str, str] = field(default_factory=dict)
    lacks: dict[str, float] = field(default_factory=dict)
    between: dict[str, Completion] = field(default_factory=dict)
    dropped: dict[str, str] = field(default_factory=dict)
    unexplained: list[DiscrepancyTerm] = field(default_factory=list)
    nearest: str = ""
    final: Fit | None = None
    settled: Settled | None = None

    @property
    def ordinary(self) -> list[Coordinate]:
        """What is fitted beside the effects."""
        return [*self.nuisances, *self.shapes]

    @property
    def selections(self) -> list[list[Trial]]:
        """The trials in which each effect in the model was named, itself first."""
        names = {c.name for c in self.effects}
        return [r.trials for r in self.rounds
                if r.accepted and r.trials[0].score.coordinate.name in names]  # fmt: skip

    def selected_in(self, name: str) -> Round:
        """Return the round in which an effect was named, the last one if it was more than once."""
        return next(r for r in reversed(self.rounds)
                    if r.accepted and r.trials[0].score.coordinate.name == name)  # fmt: skip

    @property
    def reported(self) -> Fit | None:
        """The last fit, with the reported values."""
        return self.final if self.settled is None else self.settled.fit

    @property
    def free(self) -> list[Coordinate]:
        """Everything that is fitted."""
        return [*self.ordinary, *self.effects]

    def adopt(self, fit: Fit) -> None:
        """Take over coordinates from a fit, whatever their order."""
        found = {c.name: a for c, a in zip(fit.coordinates, fit.at, strict=True)}
        self.at = np.array([found[c.name] for c in self.free])

    def settle(self, fit: Fit) -> Fit:
        """Go on from a fit of everything, and return it."""
        self.final, self.at = fit, fit.at
        return fit

    def add(self, trial: Trial) -> None:
        """Take an effect into the model."""
        known = {c.name for c in self.free}
        new = [c for c in trial.fit.coordinates[:-1] if c.name not in known]
        self.shapes += new
        self.effects.append(trial.fit.coordinates[-1])
        self.adopt(trial.fit)

    def without(self, name: str) -> list[Coordinate]:
        """Return what is free without one effect."""
        return [c for c in self.free if not c.belongs_to(name)]

    def remove(self, name: str, why: str) -> None:
        """Take an effect out of the model, and keep in words why."""
        self.dropped[name] = why
        self.settled = None
        kept = {c.name for c in self.without(name)}
        values = dict(zip([c.name for c in self.free], self.at, strict=True))
        self.shapes = [c for c in self.shapes if c.name in kept]
        self.effects = [c for c in self.effects if c.name in kept]
        self.at = np.array([values[c.name] for c in self.free])
        if self.final is not None:
            gone = {c.name for c in self.final.coordinates} - kept
            self.final = self.final.without(gone)
        self.forms.pop(name, None)
        self.between.pop(name, None)
