"""Comparison of names by evidence alone with names by rules, on kept answers.

    python -m tests.studies.rules.shadow knee.jsonl axis.jsonl

The files are those of `tests.studies.rules.ablation`.
Of every candidate that a round has refitted, the
log odds that it acts, against nothing, follow from the same numbers by which the rules decide: what
it gains on the training data and on held-out ones, each over its variance factor, and the size that
it has to have. Rounds in which the sign of the best one's odds and the rules disagree are listed;
the share of right names at a probability shows whether the probability may be printed.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.studies.generator.cases import cases_called
from tests.studies.generator.effects import EFFECTS
from tests.studies.rules.ablation import WITH_ALL, kept, report_on_files
from tests.studies.tables import wilson

SURE = 0.95
"""Probability from which a name counts as sure."""


def log_odds(trial: Mapping[str, Any], candidates: int) -> float:
    """Return the log odds that a candidate acts, by Laplace's approximation.

    A Cauchy prior of its typical size (see `scan.size_penalty`), and one missing effect among all
    candidates as likely as no missing effect.

    Args:
        trial: numbers of `evidence.Evidence`.
        candidates: among which it is one.

    """
    size, factor = abs(trial["size"]), trial["variance_factor"]
    gain, held = trial["delta_chi2"] / factor, trial["held_out"] / factor
    if gain <= 0.0 or size == 0.0:
        return -math.log(candidates)
    deviation = size / math.sqrt(gain)
    prior = 1.0 / (math.pi * (1.0 + size * size))
    occam = math.log(math.sqrt(2.0 * math.pi) * deviation * prior)
    confirmed = 0.0 if math.isnan(held) else held
    return 0.5 * (gain + confirmed) + min(occam, 0.0) - math.log(candidates)


@dataclass(frozen=True)
class Verdict:
    """Results of rules and evidence for one round.

    Attributes:
        case: its name.
        name: the candidate that comes first by the rules.
        named: whether they name it.
        nats: its log odds.
        best: the candidate with the largest ones.
        right: whether it is named in the end, for itself or for a class with what is hidden.
        stays: whether it is named in the end.

    """

    case: str
    name: str
    named: bool
    nats: float
    best: str
    right: bool
    stays: bool

    @property
    def disagree(self) -> bool:
        """Whether only one of both would name it."""
        return self.named != (self.nats > 0.0)

    @property
    def probability(self) -> float:
        """Probability of the candidate against no effect, by the evidence."""
        return 1.0 / (1.0 + math.exp(-max(-700.0, min(700.0, self.nats))))


def verdicts(file: Path) -> Iterator[Verdict]:
    """Yield the results for every round of the answers in a file."""
    for (name, without), answer in kept(file).answers.items():
        if without != WITH_ALL:
            continue
        true = {EFFECTS[key].name for key in next(cases_called(name)).effects if key in EFFECTS}
        classes = {n.name: n.members for n in answer.named}
        for round_ in answer.rounds:
            odds = {t["name"]: log_odds(t, round_["candidates"]) for t in round_["trials"]}
            for first in list(odds)[:1]:
                best, members = max(odds, key=lambda n: odds[n]), classes.get(first, set())
                yield Verdict(name, first, round_["accepted"], odds[first], best,
                              bool(true & members), bool(members))  # fmt: skip


def report(compared: Sequence[Verdict]) -> str:
    """Return the rounds in which both disagree, and how often what is sure is right."""
    lines = [
        f"{v.case}: {v.name} {'named' if v.named else 'not named'}, {v.nats:.0f} nats"
        + (f", most {v.best}" if v.best != v.name else "")
        for v in compared
        if v.disagree
    ]
    sure = [v for v in compared if v.named and v.stays and v.probability >= SURE]
    right = sum(v.right for v in sure)
    low, high = wilson(right, len(sure))
    lines += [
        f"{len(lines)} of {len(compared)} rounds in which both disagree",
        f"{right} of {len(sure)} names of {SURE:.0%} are right ({low:.2f}-{high:.2f})",
    ]  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    """Print the comparison for kept answers."""
    report_on_files(__doc__, verdicts, report)


if __name__ == "__main__":
    main()
