"""Where a search stands: its rounds, and the effects that are in the model."""

from dataclasses import dataclass, field

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.naming.blocks import BlockScore
from hil_emulator.identify.naming.contest import Trial
from hil_emulator.identify.naming.fit import Fit
from hil_emulator.identify.naming.scan import Score
from hil_emulator.identify.prediction.twin import Coordinate

NOTICEABLE = 0.01
"""Share of the innovations' variance below which an unexplained term is not worth a word: ripple
of friction and supply, which every machine has, is there and significant (assumed)."""


@dataclass
class Round:
    """One pass over the catalogue.

    Attributes:
        base: the fit before it.
        scores: of all candidates, best first.
        trials: the likeliest, refitted, best first.
        blocks: nonparametric terms, the worthwhile ones first.
        accepted: whether the first trial became part of the model.
        unknown: whether something remains that no effect explains.

    """

    base: Fit
    scores: list[Score]
    trials: list[Trial]
    blocks: list[BlockScore]
    accepted: bool = False
    unknown: bool = False

    @property
    def worthwhile(self) -> list[BlockScore]:
        """Terms that are neither chance nor too small for a word."""
        least = NOTICEABLE * len(self.base.residual)
        return [b for b in self.blocks if b.significant and b.statistic > least]


@dataclass
class Search:
    """Where a search stands.

    Attributes:
        nuisances: ordinary parameters.
        shapes: what else the laws of the effects in the model hold.
        effects: knobs of the effects in the model.
        at: coordinates of all of them, in this order.
        rounds: so far.
        form_differs: effects whose law is another one than the catalogue's.
        final: the last fit.

    """

    nuisances: list[Coordinate]
    shapes: list[Coordinate] = field(default_factory=list)
    effects: list[Coordinate] = field(default_factory=list)
    at: Array = field(default_factory=lambda: np.zeros(0))
    rounds: list[Round] = field(default_factory=list)
    form_differs: set[str] = field(default_factory=set)
    final: Fit | None = None

    @property
    def ordinary(self) -> list[Coordinate]:
        """What is fitted beside the effects."""
        return [*self.nuisances, *self.shapes]

    @property
    def free(self) -> list[Coordinate]:
        """Everything that is fitted."""
        return [*self.ordinary, *self.effects]

    def adopt(self, fit: Fit) -> None:
        """Take over coordinates from a fit, whatever their order."""
        found = {c.name: a for c, a in zip(fit.coordinates, fit.at, strict=True)}
        self.at = np.array([found[c.name] for c in self.free])

    def add(self, trial: Trial) -> None:
        """Take an effect into the model."""
        known = {c.name for c in self.free}
        new = [c for c in trial.fit.coordinates[:-1] if c.name not in known]
        self.shapes += new
        self.effects.append(trial.fit.coordinates[-1])
        self.adopt(trial.fit)

    def without(self, name: str) -> list[Coordinate]:
        """Return what is free without one effect."""
        return [c for c in self.free if c.name != name and not c.name.startswith(f"{name}.")]

    def remove(self, name: str) -> None:
        """Take an effect out of the model."""
        kept = {c.name for c in self.without(name)}
        values = dict(zip([c.name for c in self.free], self.at, strict=True))
        self.shapes = [c for c in self.shapes if c.name in kept]
        self.effects = [c for c in self.effects if c.name in kept]
        self.at = np.array([values[c.name] for c in self.free])
        self.form_differs.discard(name)
