"""Leave out every rule of the search in turn, on fresh cases of every family, and count.

    python -m tests.studies.rules.ablation --out ablation.jsonl --each 6 --watch
    python -m tests.studies.rules.ablation --out ablation.jsonl --each 6
    python -m tests.studies.rules.ablation --out ablation.jsonl --rules pairs pushed --together
    python -m tests.studies.rules.ablation --out ablation.jsonl --each 6 --report

The cases differ from those of the study; each experiment lasts 2 s. A case is searched once with
all rules, which shows the rules that decided something. It is searched again without each of these
rules, or once without all of them (`--together`); `--watch` leaves out these searches. `--again`
limits the number of cases in which a rule is left out. Other rules do not change the answer.
Answers are kept in the file of `--out`: the same command goes on where it was stopped, and a larger
`--each` adds cases.
"""

import argparse
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, get_args

from hil_emulator.config.load import load
from hil_emulator.identify import session
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import EVERYTHING, Question
from tests.identify.rig_data import CACHE
from tests.studies.answer import Answer, from_dict, from_result
from tests.studies.answer_file import append, rows
from tests.studies.generator.benches import BENCHES, FIRST, Bench
from tests.studies.generator.cases import Case, campaign, case
from tests.studies.rules.remembered import remembered
from tests.studies.rules.rules import RULES, changed
from tests.studies.rules.watching import deciding
from tests.studies.scoring import Outcome, judge
from tests.studies.tables import failed, wilson

FAMILIES = ("none", "medium", "foreign", "pairs", "foreign-pairs", "outside")
"""Healthy, the catalogue's law, another law, two of each, and what no catalogue has."""

BEGINNING = 479
"""Number of the first case, beyond those that were looked at while rules were made."""

DURATION = 2.0
"""Of each experiment [s]."""

WITH_ALL = ""
"""In place of the rule that was left out, if all rules were there."""

PLAIN = {
    "conclusion.conclude._measure": lambda *_: None,
    "conclusion.conclude.recommend": lambda *_: None,
    "conclusion.account.shares": lambda *_: {},
}
"""What an answer is illustrated with, left out here."""

PREPARED = ("counted", "without_contradictions", "PlantModel", "predicting")
"""What is done with the data before anything is decided, once for each case."""

AND = " and "
"""Between the names of rules that are left out together."""


def parts(rule: str) -> list[str]:
    """Return the rules that are left out together, or the one."""
    return rule.split(AND)


@dataclass
class Kept:
    """What is known so far.

    Attributes:
        answers: by case and by the rule that was left out.
        deciding: rules that decided something in a search with all of them, by case.

    """

    answers: dict[tuple[str, str], Answer]
    deciding: dict[str, frozenset[str]]

    def without(self, name: str, rule: str) -> Answer | None:
        """Return the answer in a case without a rule; None if there is no such answer."""
        same = not self.deciding[name] & set(parts(rule))
        return self.answers.get((name, WITH_ALL if same else rule))

    def asked(self, rule: str) -> int:
        """Return in how many cases the rule was left out."""
        return sum(left_out == rule for _, left_out in self.answers)


def drawn(
    each: int, families: Sequence[str] = FAMILIES, bench: Bench = FIRST
) -> Iterator[Case]:  # fmt: skip
    """Yield so many cases of each family, one of each before the second of any."""
    for i in range(each):
        for family in families:
            yield case(family, BEGINNING + i, DURATION, bench)


def kept(file: Path) -> Kept:
    """Return the answers in a file."""
    # a row of the blind study has no rules: all were there
    answers = [(r, r.get("without", WITH_ALL)) for r in rows(file)]
    return Kept({(r["case"], without): from_dict(r["answer"]) for r, without in answers},
                {r["case"]: frozenset(r.get("deciding", ()))
                 for r, without in answers if without == WITH_ALL})  # fmt: skip


Row = TypeVar("Row")


def report_on_files(
    description: str | None, read: Callable[[Path], Iterable[Row]],
    report: Callable[[Sequence[Row]], str],
) -> None:  # fmt: skip
    """Print a report on the rows of the files of the command line."""
    options = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("files", type=Path, nargs="+", help="that the ablation has kept")
    files = options.parse_args().files
    for file in files:
        if not file.is_file():
            options.error(f"{file}: there is no such file")
    print(report([row for file in files for row in read(file)]))


def examine(
    which: Case, rules: Sequence[str], file: Path, question: Question = EVERYTHING,
    again: float = math.inf,
) -> None:  # fmt: skip
    """Examine one case with all rules, and without each of the deciding ones; keep the answers.

    A rule is left out in at most `again` cases of the file.
    """
    done = kept(file)
    rules = [rule for rule in rules if done.asked(rule) < again]
    met = done.deciding.get(which.name)
    if met is not None and all(done.without(which.name, rule) for rule in rules):
        return
    learn, check = campaign(which)
    once = {f"session.{name}": _once(getattr(session, name)) for name in PREPARED}
    with remembered(), changed({**PLAIN, **once}):
        if met is None:
            with deciding(list(RULES)) as met:
                answer = _answered(which, learn, check, question)
            _keep(file, which, WITH_ALL, answer, deciding=sorted(met))
        for rule in rules:
            if met & set(parts(rule)) and (which.name, rule) not in done.answers:
                with changed(_without(rule)):
                    _keep(file, which, rule, _answered(which, learn, check, question))


def _without(rule: str) -> dict[str, Any]:
    return {name: new for part in parts(rule) for name, new in RULES[part].without.items()}


def _keep(file: Path, which: Case, rule: str, answer: Answer, **more: Sequence[str]) -> None:
    row = {"case": which.name, "without": rule, "answer": answer.to_dict(), **more}
    append(file, row)


def _once(work: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that computes once, and returns the first result in every call."""
    results: list[Any] = []

    def first_result(*asked: Any) -> Any:
        if not results:
            results.append(work(*asked))
        return results[0]

    return first_result


def _answered(
    which: Case, learn: Sequence[Experiment], check: Sequence[Experiment], question: Question
) -> Answer:  # fmt: skip
    start = time.monotonic()
    result = session.identify(load([which.bench.config]), learn, check, question, cache=CACHE)
    return from_result(result, time.monotonic() - start)


def essence(answer: Answer) -> tuple[object, ...]:
    """Return the essential part of an answer: names with groups and flags, and the unknown."""
    named = frozenset((n.name, frozenset(n.group), n.form_differs) for n in answer.named)
    return named, bool(answer.unknown), answer.unknown[:1]


def report(answers_kept: Kept, cases: Mapping[str, Case]) -> str:
    """Return the table of all rules, as Markdown."""
    base = {name: judge(cases[name], answers_kept.answers[name, WITH_ALL])
            for name in answers_kept.deciding if name in cases}  # fmt: skip
    heads = ["rule", "protects from", "decided in", "answers changed", *FAMILIES, "wrong names"]
    rows = [["(all rules)", "", "", "", *_counted(base.values()), _wrong(base.values())]]
    together = sorted({rule for _, rule in answers_kept.answers if AND in rule})
    for name in (*RULES, *together):
        asked = {case: answers_kept.without(case, name) for case in base}
        without = {case: judge(cases[case], answer) for case, answer in asked.items() if answer}
        with_rules = [base[case] for case in without]
        other = sum(essence(o.answer) != essence(base[case].answer) for case, o in without.items())
        decided = sum(bool(answers_kept.deciding[case] & set(parts(name))) for case in base)
        protects = RULES[name].protects if name in RULES else ""
        rows.append([name, protects, _share(decided, len(base)), _share(other, len(without)),
                     *_changed_counts(without.values(), with_rules),
                     f"{_wrong(with_rules)} → {_wrong(without.values())}"])  # fmt: skip
    lines = [f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows)]
    right = sum(not failed(o) for o in base.values())
    lines += ["", f"{_share(right, len(base))} cases right with all rules"]
    return "\n".join(lines)


def _share(count: int, among: int) -> str:
    """Return a count among cases with the 95 % interval of its share."""
    low, high = wilson(count, among)
    return f"{count} of {among} ({low:.2f}-{high:.2f})"


def _counted(outcomes: Iterable[Outcome]) -> list[str]:
    """Return the number of right answers in each family."""
    listed = list(outcomes)
    of = {f: [o for o in listed if o.case.group == f] for f in FAMILIES}
    return [f"{sum(not failed(o) for o in of[f])}/{len(of[f])}" for f in FAMILIES]


def _changed_counts(without: Iterable[Outcome], with_rules: Sequence[Outcome]) -> list[str]:
    """Return the numbers of right answers in each family in which they differ."""
    counts = zip(_counted(with_rules), _counted(without), strict=True)
    return ["" if before == after else f"{before} → {after}" for before, after in counts]


def _wrong(outcomes: Iterable[Outcome]) -> str:
    return str(sum(o.wrong for o in outcomes))


def main() -> None:
    """Run the study and print its table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path("ablation.jsonl"))
    options.add_argument("--each", type=int, default=6, help="cases of each family")
    options.add_argument("--families", nargs="*", choices=FAMILIES, default=FAMILIES)
    options.add_argument("--bench", choices=BENCHES, default=FIRST.name, help="'' is the knee")
    options.add_argument("--rules", nargs="*", choices=list(RULES), default=list(RULES))
    options.add_argument(
        "--set-points", choices=get_args(SetPoints), default=EVERYTHING.set_points,
        help="course that a user would state; by default estimated from the readings",
    )  # fmt: skip
    options.add_argument("--together", action="store_true", help="leave them out at once")
    options.add_argument("--watch", action="store_true", help="with all rules alone")
    options.add_argument(
        "--again", type=float, default=math.inf, help="most cases in which a rule is left out"
    )
    options.add_argument("--report", action="store_true", help="only print what the file has")
    chosen = options.parse_args()
    wanted = {
        which.name: which for which in drawn(chosen.each, chosen.families, BENCHES[chosen.bench])
    }
    if not chosen.report:
        question = replace(EVERYTHING, set_points=chosen.set_points)
        for which in wanted.values():
            rules = [AND.join(chosen.rules)] if chosen.together else chosen.rules
            rules = [] if chosen.watch else rules
            examine(which, rules, chosen.out, question, chosen.again)
            print(which.name, ", ".join(which.effects) or "nothing", flush=True)
    print(report(kept(chosen.out), wanted))


if __name__ == "__main__":
    main()
