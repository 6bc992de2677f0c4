"""The report of the cases: lines for a terminal, and one HTML page."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from hil_emulator.conformance.cases import CASES, CHAPTERS, OWN, Case
from hil_emulator.pages.render import render

OUTCOMES = ("passed", "failed", "skipped")
_VERDICTS = {"passed": "passed", "failed": "FAILED", "skipped": "does not apply"}


@dataclass(frozen=True)
class Judgement:
    """The outcome of one case.

    Attributes:
        outcome: "passed", "failed" or "skipped".
        reason: reason of a failed or skipped case, in one line.

    """

    outcome: str
    reason: str = ""


Judgements = Mapping[str, Judgement]
"""Outcomes by the labels of the cases, such as "2.7"."""


def table(judgements: Judgements) -> Iterator[str]:
    """Yield a table with the number of cases by chapter and outcome."""
    yield f"{'chapter':<26}{'cases':>8}" + "".join(f"{o:>9}" for o in OUTCOMES)
    for number, title in CHAPTERS.items():
        labels = [name for name, case in CASES.items() if case.chapter == number]
        yield _row(f"{number:>2}  {title}", len(labels), _count(judgements, labels))
    yield _row("all", len(CASES), _count(judgements, CASES))


def remarks(judgements: Judgements) -> Iterator[str]:
    """Yield a line for each case that was not passed."""
    for name, case in CASES.items():
        judgement = judgements.get(name)
        if judgement is not None and judgement.outcome != "passed":
            yield f"{name:>6} {case.subject}: {case.name}: {judgement.outcome}: {judgement.reason}"


def page(judgements: Judgements, about: Sequence[tuple[str, str]]) -> str:
    """Return the HTML page, in the order of the test tool's plan.

    Args:
        judgements: of the cases that were run.
        about: device and run: titles and texts.

    """
    chapters = [
        (number, title, [_line(name, case, judgements[name]) for name, case in CASES.items()
                         if case.chapter == number and name in judgements])
        for number, title in CHAPTERS.items()
    ]  # fmt: skip
    failed = [(name, CASES[name].name) for name in CASES if _failed(judgements, name)]
    counts = [
        (number, title, *(sum(line[3] == _VERDICTS[o] for line in lines) for o in OUTCOMES))
        for number, title, lines in chapters
        if lines
    ]
    return render(
        "conformance.html", title="CANopen conformance", about=about, failed=failed,
        counts=counts, chapters=[c for c in chapters if c[2]], own=OWN,
    )  # fmt: skip


def _line(name: str, case: Case, judgement: Judgement) -> tuple[str, str, str, str, str]:
    return name, case.subject, case.name, _VERDICTS[judgement.outcome], judgement.reason


def _failed(judgements: Judgements, name: str) -> bool:
    return name in judgements and judgements[name].outcome == "failed"


def _count(judgements: Judgements, labels: Sequence[str] | Mapping[str, Case]) -> Counter[str]:
    return Counter(judgements[name].outcome for name in labels if name in judgements)


def _row(title: str, cases: int, counted: Counter[str]) -> str:
    return f"{title:<26}{cases:>8}" + "".join(f"{counted[o]:>9}" for o in OUTCOMES)
