"""How much of the best candidate's gain the true effect has, which `NEARLY_ALL` rests on.

    python -m tests.studies.rules.rival_shares knee.jsonl axis.jsonl

The files are those of `tests.studies.rules.ablation`.
Mostly the true effect explains the most itself;
where another candidate does, held-out data have to choose between both, so that the true one has to
be among its rivals.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.identify.selection.levels import NEARLY_ALL
from tests.studies.generator.cases import cases_called
from tests.studies.generator.effects import EFFECTS
from tests.studies.rules.ablation import WITH_ALL, kept, report_on_files

PLAIN = 100.0
"""Gain from which a round has something to find; less may be chance."""


@dataclass(frozen=True)
class Share:
    """A round of a search in which a true effect was refitted.

    Attributes:
        case: the machine.
        true: the effect that is hidden in it, the one with the largest gain.
        best: the candidate with the largest gain.
        share: gain of the former over that of the latter.

    """

    case: str
    true: str
    best: str
    share: float


def shares(file: Path) -> Iterator[Share]:
    """Yield the rounds of the answers in a file."""
    for (name, without), answer in kept(file).answers.items():
        hidden = next(cases_called(name)).effects
        names = {EFFECTS[key].name for key in hidden if key in EFFECTS}
        for round_ in answer.rounds if without == WITH_ALL else ():
            gains = {t["name"]: float(t["delta_chi2"]) for t in round_["trials"] if not t["beside"]}
            true, best = names & gains.keys(), max(gains.values(), default=0.0)
            if true and best > PLAIN:
                first, most = max(true, key=lambda n: gains[n]), max(gains, key=lambda n: gains[n])
                yield Share(name, first, most, gains[first] / best)


def report(listed: Sequence[Share]) -> str:
    """Return the rounds in which another candidate gains more, the smallest share first."""
    behind = sorted((s for s in listed if s.share < 1.0), key=lambda s: s.share)
    rivals = sum(s.share >= NEARLY_ALL for s in behind)
    lines = [f"{s.case}: {s.true} gains {s.share:.2f} of {s.best}" for s in behind]
    return "\n".join([
        *lines, f"{len(listed) - len(behind)} of {len(listed)} true effects gain the most, "
                f"{rivals} of the others at least {NEARLY_ALL:g} of the best",
    ])  # fmt: skip


def main() -> None:
    """Print the shares of kept answers."""
    report_on_files(__doc__, shares, report)


if __name__ == "__main__":
    main()
