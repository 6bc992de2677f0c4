"""Hide effects in the independent plant, ask what is missing, and count.

python -m tests.identify.study [--kinds medium none ...] [--seed N] [--first N]
"""

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from hil_emulator.config.load import load
from hil_emulator.identify.result import Result
from hil_emulator.identify.session import identify
from tests.identify.generator.cases import (
    BALANCES,
    CALLED,
    MEDIUM,
    OUTSIDE,
    SIZES,
    Machine,
    campaign,
)
from tests.identify.rig_data import CACHE, KNEE

NAMEABLE = [name for name in MEDIUM if CALLED.get(name, name) is not None]
GROUP = 3
"""Largest class of inseparable effects that counts as an answer."""


@dataclass(frozen=True)
class Outcome:
    """What came of one machine."""

    machine: Machine
    names: tuple[str, ...]
    right: bool
    wrong: bool
    flagged: bool
    balance: bool
    error: float
    covered: bool | None
    seconds: float


def examine(machine: Machine) -> Outcome:
    """Identify one machine and judge the answer."""
    train, other = campaign(machine)
    start = time.monotonic()
    result = identify(load([KNEE]), train, other, cache=CACHE)
    seconds = time.monotonic() - start
    true = {str(CALLED.get(n, n)) for n in machine.effects if n not in OUTSIDE}
    named = [{f.name, *f.group} if len(f.group) < GROUP else {f.name} for f in result.effects]
    hit = [true & group for group in named]
    flagged = result.verdict == "unknown_effect" or bool(result.unknown)
    flagged |= any(f.form_differs for f in result.effects)
    covered, error = _value(machine, result)
    return Outcome(
        machine, tuple(f.name for f in result.effects),
        right=len(true) == len(named) and all(hit),
        wrong=any(not h for h in hit), flagged=flagged, balance=_balance(machine, result),
        error=error, covered=covered, seconds=seconds,
    )  # fmt: skip


def _value(machine: Machine, result: Result) -> tuple[bool | None, float]:
    for finding in result.effects:
        for name, size in machine.effects.items():
            if CALLED.get(name, name) == finding.name:
                low, high = finding.interval
                return low <= size <= high, abs(finding.value / size - 1.0)
    return None, math.nan


def _balance(machine: Machine, result: Result) -> bool:
    words = [BALANCES[n] for n in machine.effects if n in BALANCES]
    found = " ".join(u.balance for u in result.unknown)
    return all(word in found for word in words)


def wilson(hits: int, cases: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    if not cases:
        return 0.0, 1.0
    z, p = 1.96, hits / cases
    centre = p + z * z / (2 * cases)
    spread = z * math.sqrt(p * (1 - p) / cases + z * z / (4 * cases * cases))
    bottom = 1 + z * z / cases
    return (centre - spread) / bottom, (centre + spread) / bottom


def machines(kind: str, seed: int) -> Iterable[Machine]:
    """Return the machines of one kind of question, one pass over the effects."""
    if kind == "none":
        return [Machine({}, False, seed + i, coloured=i % 3 == 2) for i in range(10)]
    if kind == "outside":
        return [Machine({n: v}, False, seed + i) for i, (n, v) in enumerate(OUTSIDE.items())]
    if kind == "two":
        pairs = zip(NAMEABLE, NAMEABLE[7:] + NAMEABLE[:7], strict=True)
        return [Machine({a: MEDIUM[a], b: MEDIUM[b]}, False, seed + i)
                for i, (a, b) in enumerate(pairs)]  # fmt: skip
    size, _, law = kind.partition("-")
    return [Machine({n: SIZES[size] * MEDIUM[n]}, law == "foreign", seed + i)
            for i, n in enumerate(NAMEABLE)]  # fmt: skip


KINDS = ("medium", "small", "tiny", "medium-foreign", "none", "outside", "two")


def main() -> None:
    """Run the study and print its tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kinds", nargs="*", default=KINDS)
    options.add_argument("--seed", type=int, default=1000)
    options.add_argument("--first", type=int, default=None, help="only so many of each kind")
    chosen = options.parse_args()
    for kind in chosen.kinds:
        outcomes = []
        for machine in list(machines(kind, chosen.seed))[: chosen.first]:
            outcome = examine(machine)
            outcomes.append(outcome)
            mark = "right" if outcome.right else "WRONG" if outcome.wrong else "less"
            print(f"  {kind:15s} {', '.join(machine.effects) or 'none':40s} {mark:6s}"
                  f"{' flagged' if outcome.flagged else '        '} {', '.join(outcome.names)}"
                  f"  ({outcome.seconds:.0f} s, value off {100 * outcome.error:.1f} %)",
                  flush=True)  # fmt: skip
        report(kind, outcomes)


def report(kind: str, outcomes: list[Outcome]) -> None:
    """Print shares with Wilson intervals."""
    n = len(outcomes)
    counts = {
        "exactly right": sum(o.right for o in outcomes),
        "with a wrong name": sum(o.wrong for o in outcomes),
        "wrong name, not flagged": sum(o.wrong and not o.flagged for o in outcomes),
        "flagged": sum(o.flagged for o in outcomes),
    }
    if kind == "outside":
        counts["right balance"] = sum(o.balance for o in outcomes)
    for words, hits in counts.items():
        low, high = wilson(hits, n)
        print(f"{kind:15s} {words:24s} {hits:3d}/{n}  95 %: {low:.2f} ... {high:.2f}")
    errors = sorted(o.error for o in outcomes if not math.isnan(o.error))
    covered = [o.covered for o in outcomes if o.covered is not None]
    if errors:
        print(f"{kind:15s} median error {100 * errors[len(errors) // 2]:.1f} %, "
              f"value inside its interval {sum(covered)}/{len(covered)}")  # fmt: skip
    wrong = Counter(name for o in outcomes if o.wrong for name in o.names)
    if wrong:
        print(f"{kind:15s} named where wrong: {dict(wrong)}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
