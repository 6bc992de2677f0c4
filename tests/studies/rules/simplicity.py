"""How nearly laws with fewer assumed shapes explain the same, which `SMALL_PART` rests on.

    python -m tests.studies.rules.simplicity knee.jsonl axis.jsonl

The files are those of `tests.studies.rules.ablation`.
A law with more shapes bends to what the true one
does and explains as much; a law with fewer that is not the true one explains less. In between lies
what makes two laws equal, so that the simpler one comes first.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.selection.levels import NEARLY_ALL, SMALL_PART
from tests.identify.rig_data import INSTRUMENTS, knee_model
from tests.studies.generator.cases import cases_called
from tests.studies.generator.effects import EFFECTS
from tests.studies.rules.ablation import WITH_ALL, kept, report_on_files
from tests.studies.rules.rival_shares import PLAIN

OWN_LAWS = ("medium", "pairs")
"""Families whose effects follow the catalogue's laws."""

TOLD = 3
"""Largest number of listed pairs of laws of either kind."""


@dataclass(frozen=True)
class Rivalry:
    """A true law and a rival with another number of assumed shapes.

    Attributes:
        case: the machine.
        true: the effect that is hidden in it.
        rival: the other one.
        simpler: whether the true one has fewer.
        share: what the law with fewer gains over the other one, of training or held-out data.

    """

    case: str
    true: str
    rival: str
    simpler: bool
    share: float


def rivalries(file: Path) -> Iterator[Rivalry]:
    """Yield the rivalries in the answers of a file, of machines with the catalogue's laws."""
    shapes = {c.name: len(c.effect.shape) for c in candidates(knee_model(), INSTRUMENTS)
              if c.effect}  # fmt: skip
    for (name, without), answer in kept(file).answers.items():
        case = next(cases_called(name))
        names = {EFFECTS[key].name for key in case.effects if key in EFFECTS}
        if without == WITH_ALL and case.group in OWN_LAWS:
            for round_ in answer.rounds:
                for true, rival in _rivals(round_["trials"], names):
                    fewer = shapes.get(rival["name"], 0) - shapes.get(true["name"], 0)
                    few, many = (true, rival) if fewer > 0 else (rival, true)
                    if fewer:
                        yield Rivalry(
                            name, true["name"], rival["name"], fewer > 0, _share(few, many)
                        )


def _rivals(
    trials: Sequence[Mapping[str, Any]], true: set[str]
) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Yield the true effect with the largest gain, and those that contend with it for the name."""
    alone = [t for t in trials if not t["beside"] and t["held_out"] > 0.0 and _gain(t) > PLAIN]
    mine = [t for t in alone if t["name"] in true]
    if not mine:
        return
    best = max(mine, key=_gain)
    for rival in alone:
        less, more = sorted((_gain(rival), _gain(best)))
        if rival["name"] not in true and less > NEARLY_ALL * more:
            yield best, rival


def _gain(trial: Mapping[str, Any]) -> float:
    return float(trial["delta_chi2"])


def _share(few: Mapping[str, Any], many: Mapping[str, Any]) -> float:
    """Return the smaller share of what both gain, in training and in held-out data."""
    return float(min(few[gain] / many[gain] for gain in ("delta_chi2", "held_out")))


def report(pairs: Sequence[Rivalry]) -> str:
    """Return the nearest cases of either kind, and how many are on the wrong side."""
    true = sorted((r for r in pairs if r.simpler), key=lambda r: r.share)
    others = sorted((r for r in pairs if not r.simpler), key=lambda r: -r.share)
    lines = [f"{r.case}: {r.true}, which is true, gains {r.share:.3f} of {r.rival}"
             for r in true[:TOLD]]  # fmt: skip
    lines += [f"{r.case}: {r.rival} gains {r.share:.3f} of {r.true}, which is true"
              for r in others[:TOLD]]  # fmt: skip
    equal = sum(r.share >= 1.0 - SMALL_PART for r in true)
    wrong = sum(r.share >= 1.0 - SMALL_PART for r in others)
    both = f"{equal} of {len(true)} true laws with fewer shapes are equal to a rival"
    return "\n".join([*lines, f"{both}, {wrong} of {len(others)} wrong ones to the true law"])


def main() -> None:
    """Print the rivalries in kept answers."""
    report_on_files(__doc__, rivalries, report)


if __name__ == "__main__":
    main()
