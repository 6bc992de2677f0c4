"""What an examiner answers about one case, as plain data that can be kept in a file."""

import math
from dataclasses import asdict, dataclass, field
from typing import Any

from hil_emulator.identify.conclusion.findings import Finding
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.selection.progress import Round


@dataclass(frozen=True)
class Named:
    """One named effect.

    Attributes:
        name: the effect.
        group: other effects from which the data do not separate it.
        form_differs: whether its law is reported to have another form.
        value: of the knob, SI.
        low: lower end of the stated 95 % interval.
        high: its upper end.
        evidence: for the name.

    """

    name: str
    group: tuple[str, ...] = ()
    form_differs: bool = False
    value: float = math.nan
    low: float = math.nan
    high: float = math.nan
    evidence: str = ""

    @property
    def members(self) -> set[str]:
        """The class that it stands for."""
        return {self.name, *self.group}


@dataclass(frozen=True)
class Answer:
    """The whole answer.

    Attributes:
        named: effects, in the order in which they were found.
        unknown: balance and regressor of every unexplained term, the strongest first.
        nearest: the best effect that was not named, or "".
        separates: the experiment that would separate the members of a group, or "".
        verdict: in a word.
        evidence: for and against the best rivals.
        seconds: time it took.
        hardly_believed: parameters that hardly any machine has, in words.
        parameters: of each ordinary parameter both ends of its 95 % interval, by name, SI.
        rounds: the numbers behind it, see `numbers_of`.

    """

    named: tuple[Named, ...] = ()
    unknown: tuple[tuple[str, str], ...] = ()
    nearest: str = ""
    separates: str = ""
    verdict: str = ""
    evidence: tuple[str, ...] = ()
    seconds: float = 0.0
    extra: dict[str, Any] = field(default_factory=dict)
    rounds: tuple[dict[str, Any], ...] = ()
    hardly_believed: tuple[str, ...] = ()
    parameters: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def flagged(self) -> bool:
        """Whether it reports another law or something unknown, or does not decide."""
        open_ = self.verdict == "cannot_tell" or bool(self.unknown or self.hardly_believed)
        return open_ or any(n.form_differs for n in self.named)

    def to_dict(self) -> dict[str, Any]:
        """Return it for a file."""
        return asdict(self)


def from_dict(kept: dict[str, Any]) -> Answer:
    """Return an answer from a file."""
    named = tuple(Named(**{**n, "group": tuple(n["group"])}) for n in kept["named"])
    unknown = tuple((b, d) for b, d in kept["unknown"])
    return Answer(**{**kept, "named": named, "unknown": unknown,
                     "evidence": tuple(kept["evidence"]),
                     "hardly_believed": tuple(kept.get("hardly_believed", ())),
                     "parameters": {n: (a, b) for n, (a, b) in kept.get("parameters", {}).items()},
                     "rounds": tuple(kept.get("rounds", ()))})  # fmt: skip


def from_result(result: Result, seconds: float) -> Answer:
    """Return the answer of the product."""
    lines = _rounds(result)
    return Answer(
        named=tuple(_named(f) for f in result.effects),
        unknown=tuple((u.balance, u.regressor) for u in result.unknown),
        nearest=_nearest(result), separates=result.next_experiment or "",
        verdict=result.verdict, evidence=tuple(lines), seconds=seconds,
        rounds=tuple(map(numbers_of, result.search.rounds if result.search else ())),
        hardly_believed=tuple(result.implausible),
        parameters={name: (p.low, p.high) for name, p in result.parameters.items()},
    )  # fmt: skip


def numbers_of(searched: Round) -> dict[str, Any]:
    """Return what a round has found out about its candidates and free terms, as plain numbers."""
    trials = [
        {"name": t.score.coordinate.name, "passed": t.evidence.passed, "beside": t.partner,
         "deviation": t.deviation, **asdict(t.evidence)}
        for t in searched.trials
    ]  # fmt: skip
    terms = [
        {"balance": t.balance.name, "regressor": t.regressor, "gain": t.statistic,
         "limit": t.limit, "hats": len(t.knots)}
        for t in searched.terms[:3]
    ]  # fmt: skip
    return {"accepted": searched.accepted, "candidates": len(searched.scores), "trials": trials,
            "terms": terms}  # fmt: skip


def _named(f: Finding) -> Named:
    held = "-" if f.held_out is None else f"{f.held_out:.0f}"
    rivals = "; ".join(f"{r.name}: {r.lost}" for r in f.rivals[:2])
    return Named(f.name, tuple(f.group), f.form_differs, f.value, *f.interval,
                 evidence=f"gain {f.delta_chi2:.0f}, held out {held}; {rivals}")  # fmt: skip


def _nearest(result: Result) -> str:
    if result.nearest:
        return result.nearest
    if result.search is None or not result.search.rounds:
        return ""
    trials = result.search.rounds[-1].trials
    return str(trials[0].score.coordinate.name) if trials else ""


def _rounds(result: Result) -> list[str]:
    """Return the best trials and terms of every round of the search."""
    lines = []
    for i, searched in enumerate(result.search.rounds if result.search else ()):
        for t in searched.trials[:3]:
            e = t.evidence
            lines.append(
                f"round {i + 1}{' accepted' if searched.accepted else ''}: "
                f"{t.score.coordinate.name} gain {e.delta_chi2:.0f} Wald {e.wald:.0f} "
                f"held out {e.held_out:.0f} size {t.fit.at[-1]:.3g}"
            )
        lines += [
            f"round {i + 1} block: {t.balance.name} by {t.regressor} {t.statistic:.0f} "
            f"(limit {t.limit:.0f})" for t in searched.terms[:3] if t.significant
        ]  # fmt: skip
    return lines
