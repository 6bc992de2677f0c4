"""How far values are off, and by how many deviations, with friction's ripple and beside it.

    python -m tests.studies.accuracy.told_values medium-572:15 pairs-572:15
    python -m tests.studies.accuracy.told_values foreign-572:15 medium-547:5@axis

Of each effect that is named: the error of the fit that ends the search and of what is told, the
half width of its interval, and the probability that the sizes of its experiments are apart by
chance. Of all ordinary parameters of right answers: what they are off by in standard deviations.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.selection.levels import NORMAL_95
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE
from tests.studies.answer import from_result
from tests.studies.generator.cases import Case, campaign, machine, short_cases
from tests.studies.scoring import ORDINARY, judge, true_size


@dataclass(frozen=True)
class Told:
    """An effect that was rightly named.

    Attributes:
        name: the effect.
        friction: whether it is a law of friction.
        fitted: relative error of the fit that ended the search.
        told: the same of what is told.
        width: half width of the interval, over the value.
        inside: whether the true value is in it.
        by_chance: probability that the sizes of the experiments are as far apart by chance.

    """

    name: str
    friction: bool
    fitted: float
    told: float
    width: float
    inside: bool
    by_chance: float


def values(which: Case, result: Result) -> Iterator[Told]:
    """Yield the effects that were rightly named."""
    search = result.search
    if search is None or search.final is None or search.settled is None:
        return
    fitted = dict(zip([c.name for c in search.final.coordinates], search.final.at, strict=True))
    for finding in result.effects:
        true = true_size(which, finding.name)
        if math.isnan(true):
            continue
        coordinate = next(c for c in search.effects if c.name == finding.name)
        first, (low, high) = coordinate.value(float(fitted[finding.name])), finding.interval
        yield Told(
            finding.name, "friction" in finding.name, abs(first / true - 1.0),
            abs(finding.value / true - 1.0), 0.5 * (high - low) / abs(finding.value),
            low <= true <= high, search.settled.sizes[finding.name].by_chance,
        )  # fmt: skip


def off(which: Case, result: Result) -> Iterator[float]:
    """Yield what each ordinary parameter is off by, in the deviations that its interval has."""
    real = machine(which)
    for name, told in result.parameters.items():
        if name in ORDINARY and told.high > told.low:
            deviation = 0.5 * (told.high - told.low) / NORMAL_95
            yield (told.refitted - ORDINARY[name](real)) / deviation


def report(effects: Sequence[Told], deviations: Sequence[float]) -> list[str]:
    """Return the medians, and how many are inside."""
    lines = []
    for kind, some in (("friction", [e for e in effects if e.friction]), ("all", effects)):
        if some:
            fitted, told, width = (
                float(np.median([getattr(e, key) for e in some]))
                for key in ("fitted", "told", "width")
            )
            lines.append(f"{kind}: {len(some)} effects, median error {fitted:.2%} fitted, "
                         f"{told:.2%} told, half width {width:.2%}, "
                         f"{sum(e.inside for e in some)} inside")  # fmt: skip
    if len(deviations):
        size, inside = np.abs(deviations), np.abs(deviations) < NORMAL_95
        lines.append(f"{len(size)} ordinary parameters: off by {np.sqrt(np.mean(size**2)):.2f} "
                     f"deviations (root mean square), {np.mean(inside):.1%} inside")  # fmt: skip
    return lines


def main() -> None:
    """Print what is told of each machine, and the medians."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "cases", nargs="+", type=short_cases, help="such as medium-572, or pairs-572:15@axis"
    )
    effects: list[Told] = []
    deviations: list[float] = []
    for which in (c for some in options.parse_args().cases for c in some):
        learn, check = campaign(which)
        result = identify(load([which.bench.config]), learn, check, cache=CACHE)
        found = list(values(which, result))
        effects += found
        if judge(which, from_result(result, 0.0)).exact and not which.foreign:
            deviations += off(which, result)
        for e in found:
            print(f"{which.name:16} {e.name:26} fitted {e.fitted:7.2%}, told {e.told:7.2%} "
                  f"+- {e.width:7.2%}{'' if e.inside else ' MISSED'}, sizes apart by chance "
                  f"{e.by_chance:.1e}", flush=True)  # fmt: skip
    print("\n".join(report(effects, deviations)))


if __name__ == "__main__":
    main()
