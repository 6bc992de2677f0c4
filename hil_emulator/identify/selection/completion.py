"""Rivals that complete the law of a named effect, and are no further effect.

Play of several elements, named as that of one, leaves something that a hysteresis explains, which
had explained nearly as much in its place. The law is one between both.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from hil_emulator.identify.selection.evidence import GREATER_PART, SMALL_PART, Trial


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


def completions(
    selections: Iterable[Sequence[Trial]], trials: Sequence[Trial]
) -> Mapping[str, Completion]:  # fmt: skip
    """Return which candidates only complete a law, by name, those that explain the most first.

    Where a near rival does, others at its place that do the same work and no more of it do too.

    Args:
        selections: the trials in which each effect in the model was named, itself first.
        trials: of the round.

    """
    found: dict[str, Completion] = {}
    completing: list[tuple[Trial, Trial]] = []
    rivalled = {_name(rival): best for best, rival in near(selections)}
    for trial in sorted(trials, key=lambda t: -t.evidence.delta_chi2):
        likely = [best for best, rival in completing if _same_work(trial, rival)]
        best = rivalled.get(_name(trial)) or (likely[0] if likely else None)
        if best is None or not trial.evidence.passed:
            continue
        part = trial.evidence.delta_chi2 / best.evidence.delta_chi2
        if part < SMALL_PART:
            found[_name(trial)] = Completion(_name(best), _name(trial), part)
            completing.append((best, trial))
    return found


def _same_work(trial: Trial, rival: Trial) -> bool:
    """Tell whether a candidate acts at the place of another, and mostly does what that does."""
    one, other = trial.score, rival.score
    product = float(one.column @ other.column)
    alike = product**2 > GREATER_PART * one.information * other.information
    return alike and one.coordinate.place == other.coordinate.place


def near(selections: Iterable[Sequence[Trial]]) -> Iterator[tuple[Trial, Trial]]:
    """Yield effects with the rivals at the same place that explained nearly as much."""
    # where the best explains everything, a rival's part of it is the squared cosine between both
    for best, *rivals in selections:
        for rival in rivals:
            here = rival.score.coordinate.place == best.score.coordinate.place
            if here and rival.evidence.delta_chi2 > GREATER_PART * best.evidence.delta_chi2:
                yield best, rival


def _name(trial: Trial) -> str:
    return trial.score.coordinate.name
