"""Rivals that complete the law of a named effect, and are no further effect.

Play of several elements, named as that of one, leaves something that a hysteresis explains, which
had explained nearly as much in its place. The law is one between both.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from hil_emulator.identify.naming.contest import Trial

RIVALLED = 0.75
"""Part of the gain of an effect, when it was named, that the rival had then (assumed)."""

BETWEEN = 0.1
"""Part of that gain below which the rival only completes its law (assumed)."""


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
    contests: Iterable[Sequence[Trial]], trials: Sequence[Trial]
) -> Mapping[str, Completion]:  # fmt: skip
    """Return which candidates only complete a law, by name.

    Args:
        contests: of each effect in the model, the trials in which it was named, itself first.
        trials: of the round.

    """
    found = {}
    for trial in (t for t in trials if t.evidence.passed):
        for best, *rivals in contests:
            part = trial.evidence.gain / best.evidence.gain
            rivalled = any(_name(r) == _name(trial)
                           and r.evidence.gain > RIVALLED * best.evidence.gain
                           for r in rivals)  # fmt: skip
            if rivalled and part < BETWEEN and place(best) == place(trial):
                found[_name(trial)] = Completion(_name(best), _name(trial), part)
    return found


def _name(trial: Trial) -> str:
    return trial.score.coordinate.name


def place(trial: Trial) -> str:
    """Return the sensor, or the part of the machine, at which a candidate acts."""
    coordinate = trial.score.coordinate
    return coordinate.channel or (coordinate.effect.stage.table if coordinate.effect else "")
