"""The study's tables: shares with Wilson intervals, confusion, values, failures."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tests.studies.generator.effects import EFFECTS
from tests.studies.scoring import Outcome

Rule = tuple[str, Callable[[Outcome], bool], str]

RULES: dict[str, tuple[Rule, ...]] = {
    "medium": (("exactly named", lambda o: o.exact, ">= 0.95"),
               ("wrong name", lambda o: o.wrong > 0, "")),
    "small": (("exactly named", lambda o: o.exact, ">= 0.90"),
              ("wrong name", lambda o: o.wrong > 0, "")),
    "tiny": (("wrong name", lambda o: o.wrong > 0, "<= 0.02"),
             ("exactly named", lambda o: o.exact, "")),
    "foreign": (("named, or flagged and nearest", lambda o: o.known, ">= 0.90"),
                ("wrong name without flag", lambda o: o.hushed, "<= 0.05"),
                ("exactly named", lambda o: o.exact, "")),
    "pairs": (("exactly named", lambda o: o.exact, ">= 0.90"),
              ("wrong name", lambda o: o.wrong > 0, "")),
    "triples": (("exactly named", lambda o: o.exact, ">= 0.80"),
                ("wrong name", lambda o: o.wrong > 0, "")),
    "foreign-pairs": (("exactly named", lambda o: o.exact, ""),),
    "none": (("any name", lambda o: bool(o.answer.named), "<= 0.01"),
             ("unexplained", lambda o: o.flagged, "<= 0.05")),
    "outside": (("flagged", lambda o: o.flagged, ">= 0.90"),
                ("right balance", lambda o: o.place, ">= 0.80"),
                ("passed off as clean", lambda o: o.hushed, "<= 0.03")),
}  # fmt: skip
"""What is counted in each group, and the share that is asked for."""


CONTROLS: dict[str, tuple[Rule, ...]] = {
    "deleted": (("named in its stead, without flag", lambda o: o.hushed, "<= 0.03"),
                ("flagged", lambda o: o.flagged, ""),
                ("no name, no flag", lambda o: not o.flagged and not o.answer.named, "")),
    "reversed": (("any name", lambda o: bool(o.answer.named), "<= 0.03"),),
}  # fmt: skip
"""What is counted in the negative controls, whatever was hidden."""


def wilson(hits: int, cases: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    if not cases:
        return 0.0, 1.0
    z, p = 1.96, hits / cases
    centre = p + z * z / (2 * cases)
    spread = z * math.sqrt(p * (1 - p) / cases + z * z / (4 * cases * cases))
    bottom = 1 + z * z / cases
    return max(centre - spread, 0.0) / bottom, (centre + spread) / bottom


def share(words: str, hits: int, cases: int, asked: str) -> str:
    """Return one line of the table."""
    low, high = wilson(hits, cases)
    part = f"{hits / cases:.2f}" if cases else "-"
    return f"{words:56s} {hits:4d}/{cases:<4d} {part:>5s}   {low:.2f} ... {high:.2f}   {asked}"


def groups(outcomes: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    """Return outcomes by group, in the order of the rules."""
    return {g: of_group for g in RULES if (of_group := [o for o in outcomes if o.case.group == g])}


def table(outcomes: Sequence[Outcome]) -> list[str]:
    """Return shares by group with Wilson intervals."""
    lines = [f"{'':56s} {'cases':>9s} {'share':>5s}   95 % interval   asked"]
    for group, of_group in groups(outcomes).items():
        for words, rule, asked in RULES[group]:
            lines.append(share(f"{group}: {words}", sum(map(rule, of_group)), len(of_group), asked))
        if group in ("pairs", "triples", "foreign-pairs"):
            hits, named = sum(o.hits for o in of_group), sum(o.hits + o.wrong for o in of_group)
            hidden = sum(len(o.case.effects) for o in of_group)
            foreign = group == "foreign-pairs"
            lines.append(share(f"{group}: precision", hits, named, ">= 0.95" if foreign else ""))
            lines.append(share(f"{group}: recall", hits, hidden, ">= 0.75" if foreign else ""))
    return lines


def values(outcomes: Sequence[Outcome]) -> list[str]:
    """Return errors of values and how often the stated intervals hold, by group."""
    lines = []
    for group, of_group in groups(outcomes).items():
        errors = [e for o in of_group for e in o.errors]
        covered = [c for o in of_group for c in o.covered]
        if errors:
            q = np.quantile(errors, [0.5, 0.9])
            lines.append(f"{group}: value off by {100 * q[0]:.1f} % (median), "
                         f"{100 * q[1]:.1f} % (nine of ten below)")  # fmt: skip
            lines.append(share(f"{group}: true value in its interval", sum(covered), len(covered),
                               "0.85 ... 0.99"))  # fmt: skip
    # parameters compensate for effects that the model lacks
    true = [o for o in outcomes if o.exact and o.case.group != "outside" and not o.case.foreign]
    ordinary = [inside for o in true for inside in o.ordinary.values()]
    if ordinary:
        lines.append(share("right answers: ordinary parameter in its interval", sum(ordinary),
                           len(ordinary), "0.90 ... 0.99"))  # fmt: skip
    return lines


def confusion(outcomes: Sequence[Outcome]) -> list[str]:
    """Return, for single effects, what each was called."""
    single = [o for o in outcomes if o.case.group in ("medium", "small", "foreign")]
    lines = []
    for key, hidden in EFFECTS.items():
        called: Counter[str] = Counter()
        for o in (o for o in single if key in o.case.effects):
            names = [n.name + ("*" if n.form_differs else "") for n in o.answer.named]
            quiet = ["unknown"] if o.answer.unknown else ["nothing"]
            called.update([" + ".join(names)] if names else quiet)
        if called:
            words = ", ".join(f"{name} {count}" for name, count in called.most_common())
            lines.append(f"{hidden.name:26s} {words}")
    return lines


def failures(outcomes: Sequence[Outcome]) -> list[str]:
    """Return every case with a wrong answer, and the answer."""
    lines = []
    for o in outcomes:
        if failed(o):
            lines += ["", *described(o)]
    return lines


def failed(o: Outcome) -> bool:
    """Whether an answer is not what is asked for."""
    group = o.case.group
    if group == "tiny":
        return o.wrong > 0
    if group == "foreign":
        return not o.known
    if group == "outside":
        return not o.flagged or not o.place
    return not o.exact


def described(o: Outcome) -> list[str]:
    """Return one case in words."""
    truth = ", ".join(f"{k} {v:.3g}" for k, v in o.case.effects.items()) or "nothing"
    bench = [w for w, on in (("wide", o.case.wide), ("dirty", o.case.dirty)) if on]
    lines = [f"{o.case.name}: hidden {truth} ({', '.join([*bench, f'{o.case.duration:g} s'])})"]
    lines.append(f"  verdict {o.answer.verdict}, nearest {o.answer.nearest or '-'}")
    for n in o.answer.named:
        form = " (form differs)" if n.form_differs else ""
        lines.append(f"  named {n.name}{form} {n.value:.4g} [{n.low:.4g} ... {n.high:.4g}], "
                     f"class {sorted(n.group)}: {n.evidence}")  # fmt: skip
    lines += [f"  unexplained: {b} by {d}" for b, d in o.answer.unknown]
    return lines + [f"    {line}" for line in o.answer.evidence]


def report(outcomes: Sequence[Outcome], method: str = "product") -> str:
    """Return all tables of one method as one text."""
    seconds = [o.answer.seconds for o in outcomes]
    time = f"{len(outcomes)} cases, {np.mean(seconds):.1f} s each (longest {max(seconds):.0f} s)"
    if method in CONTROLS:
        parts = [[method, time], control(outcomes, method),
                 ["every case:", *(line for o in outcomes for line in described(o))]]  # fmt: skip
    else:
        parts = [[method, time], table(outcomes), values(outcomes), confusion(outcomes),
                 ["every failure:", *failures(outcomes)]]  # fmt: skip
    return "\n\n".join("\n".join(p) for p in parts if p)


def control(outcomes: Sequence[Outcome], method: str) -> list[str]:
    """Return the shares of a negative control."""
    return [
        share(f"{method}: {words}", sum(map(rule, outcomes)), len(outcomes), asked)
        for words, rule, asked in CONTROLS[method]
    ]


def changed(pairs: Sequence[tuple[Outcome, Outcome]]) -> str:
    """Return the cases of which one of two answers is as asked for, each in its words, and counts.

    Args:
        pairs: of the same case, the present outcome and an earlier one.

    """
    better = [now for now, before in pairs if failed(before) and not failed(now)]
    worse = [now for now, before in pairs if failed(now) and not failed(before)]
    lines = [f"of {len(pairs)} cases {len(better)} are better and {len(worse)} worse than before"]
    for words, outcomes in (("better", better), ("worse", worse)):
        lines += [f"{words}: {line}" for o in outcomes for line in described(o)[:3]]
    return "\n".join(lines)


def compared(by_method: Mapping[str, Sequence[Outcome]]) -> str:
    """Return the first share of every group for several methods, on the cases all have."""
    asked = {m: of_group for m, of_group in by_method.items() if m not in CONTROLS and of_group}
    common = set.intersection(*({o.case.name for o in of_group} for of_group in asked.values()))
    lines = ["methods compared on the cases that all have examined:"]
    for group, rules in RULES.items():
        for words, rule, _ in rules[:2]:
            for method, of_group in asked.items():
                same = [o for o in of_group if o.case.name in common and o.case.group == group]
                if same:
                    text = f"{group}: {words} ({method})"
                    lines.append(share(text, sum(map(rule, same)), len(same), ""))
    return "\n".join(lines)
