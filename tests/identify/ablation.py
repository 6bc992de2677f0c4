"""Leave out every rule of the search in turn, on fresh cases of every family, and count.

    python -m tests.identify.ablation --out ablation.jsonl --each 6
    python -m tests.identify.ablation --out ablation.jsonl --report

Cases are none of the study's; each experiment lasts two seconds. Answers are kept in the file of
`--out`: the same command goes on where it was stopped, and a larger `--each` adds cases. A case is
not searched again without a rule that decided nothing in it.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hil_emulator.config.load import load
from hil_emulator.identify import session
from hil_emulator.identify.measured.experiment import Experiment
from tests.identify.answer import Answer, from_dict, from_result
from tests.identify.generator.cases import Case, campaign, case
from tests.identify.remembered import remembered
from tests.identify.rig_data import CACHE, KNEE
from tests.identify.rules import RULES, changed
from tests.identify.scoring import Outcome, judge
from tests.identify.tables import failed, wilson
from tests.identify.watching import deciding

FAMILIES = ("none", "medium", "foreign", "pairs", "foreign-pairs", "outside")
"""Healthy, the catalogue's law, another law, two of each, and what no catalogue has."""

FIRST, STRIDE = 121, 4
"""Numbers of the cases, beyond those of the study; the stride meets every kind of bench."""

DURATION = 2.0
"""Of each experiment [s]."""

WITH_ALL = ""
"""In the place of the rule that was left out, where none was."""

PLAIN = {
    "conclusion.conclude._measure": lambda *_: None,
    "conclusion.conclude.recommend": lambda *_: None,
    "conclusion.account.shares": lambda *_: {},
}
"""What an answer is illustrated with, left out here."""

MACHINE = load([KNEE])

PREPARED = ("counted", "without_contradictions", "PlantModel", "predicting")
"""What is done with the data before anything is decided, once for each case."""

Answers = dict[tuple[str, str], Answer]
"""By case and by the rule that was left out."""


def drawn(each: int) -> Iterator[Case]:
    """Yield so many cases of each family, one of each before the second of any."""
    for i in range(each):
        for family in FAMILIES:
            yield case(family, FIRST + STRIDE * i, DURATION)


def kept(file: Path) -> Answers:
    """Return the answers that a file has already."""
    rows = map(json.loads, file.read_text().splitlines()) if file.exists() else ()
    return {(r["case"], r["without"]): from_dict(r["answer"]) for r in rows}


def examine(which: Case, rules: Sequence[str], file: Path) -> None:
    """Ask about one case without each of some rules, and keep the answers."""
    done = kept(file)
    wanted = [rule for rule in (WITH_ALL, *rules) if (which.name, rule) not in done]
    if not wanted:
        return
    learn, check = campaign(which)
    once = {f"session.{name}": _once(getattr(session, name)) for name in PREPARED}
    with remembered(), changed({**PLAIN, **once}):
        with deciding(rules) as met:
            with_all = _answered(learn, check)
        for rule in wanted:
            answer = with_all
            if rule in met:
                with changed(RULES[rule].without):
                    answer = _answered(learn, check)
            row = {"case": which.name, "without": rule, "answer": answer.to_dict()}
            with file.open("a") as stream:
                stream.write(json.dumps(row) + "\n")


def _once(work: Callable[..., Any]) -> Callable[..., Any]:
    """Return the same, which is asked the same all over again, with its first answer kept."""
    found: list[Any] = []

    def known(*asked: Any) -> Any:
        if not found:
            found.append(work(*asked))
        return found[0]

    return known


def _answered(learn: Sequence[Experiment], check: Sequence[Experiment]) -> Answer:
    start = time.monotonic()
    result = session.identify(MACHINE, learn, check, cache=CACHE)
    return from_result(result, time.monotonic() - start)


def said(answer: Answer) -> tuple[object, ...]:
    """Return what of an answer matters: names with their classes and flags, and the unknown."""
    named = frozenset((n.name, frozenset(n.group), n.form_differs) for n in answer.named)
    return named, bool(answer.unknown), answer.unknown[:1]


def report(answers: Answers, cases: Mapping[str, Case]) -> str:
    """Return the table of all rules, as Markdown."""
    base = {name: judge(cases[name], answer) for (name, rule), answer in answers.items()
            if rule == WITH_ALL and name in cases}  # fmt: skip
    heads = ["rule", "protects from", "answers changed", *FAMILIES, "wrong names"]
    rows = [["(all rules)", "", "", *_counted(base.values()), _wrong(base.values())]]
    for name, rule in RULES.items():
        without = {c: judge(cases[c], answers[c, name]) for c in base if (c, name) in answers}
        beside = [base[c] for c in without]
        changed_answers = sum(said(answers[c, name]) != said(base[c].answer) for c in without)
        rows.append([name, rule.protects, f"{changed_answers} of {len(without)}",
                     *_beside(without.values(), beside),
                     f"{_wrong(beside)} → {_wrong(without.values())}"])  # fmt: skip
    lines = [f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows)]
    right = sum(not failed(o) for o in base.values())
    low, high = wilson(right, len(base))
    lines += ["", f"{right} of {len(base)} cases right with all rules ({low:.2f} ... {high:.2f})"]
    return "\n".join(lines)


def _counted(outcomes: Iterator[Outcome] | Sequence[Outcome]) -> list[str]:
    """Return how many are right of each family."""
    found = list(outcomes)
    of = {f: [o for o in found if o.case.group == f] for f in FAMILIES}
    return [f"{sum(not failed(o) for o in of[f])}/{len(of[f])}" for f in FAMILIES]


def _beside(without: Iterator[Outcome], beside: Sequence[Outcome]) -> list[str]:
    """Return how many are right of each family where that is another number."""
    counts = zip(_counted(beside), _counted(without), strict=True)
    return ["" if before == after else f"{before} → {after}" for before, after in counts]


def _wrong(outcomes: Iterator[Outcome] | Sequence[Outcome]) -> str:
    return str(sum(o.wrong for o in outcomes))


def main() -> None:
    """Run the study and print its table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path("ablation.jsonl"))
    options.add_argument("--each", type=int, default=6, help="cases of each family")
    options.add_argument("--rules", nargs="*", choices=list(RULES), default=list(RULES))
    options.add_argument("--report", action="store_true", help="only print what the file has")
    chosen = options.parse_args()
    wanted = {which.name: which for which in drawn(chosen.each)}
    if not chosen.report:
        for which in wanted.values():
            examine(which, chosen.rules, chosen.out)
            print(which.name, ", ".join(which.effects) or "nothing", flush=True)
    print(report(kept(chosen.out), wanted))


if __name__ == "__main__":
    main()
