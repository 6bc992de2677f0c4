"""Errors of reported values, and of values that were fitted without the ripple of friction.

    python -m tests.studies.accuracy.reported_values medium-572:15 pairs-572:15
    python -m tests.studies.accuracy.reported_values foreign-572:15 medium-547:5@axis

For each named effect: the errors of the fit that ends the search and of the reported value, the
half width of its interval, and the probability that its sizes by experiment differ by chance. For
the ordinary parameters of right answers: their errors in standard deviations.
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
class Reported:
    """An effect that was rightly named.

    Attributes:
        name: the effect.
        friction: whether it is a law of friction.
        fitted: relative error of the fit that ended the search.
        reported: relative error of the reported value.
        width: half width of the interval, over the value.
        inside: whether the true value is in it.
        by_chance: probability that the sizes of the experiments are as far apart by chance.

    """

    name: str
    friction: bool
    fitted: float
    reported: float
    width: float
    inside: bool
    by_chance: float


def values(which: Case, result: Result) -> Iterator[Reported]:
    """Yield the effects that were rightly named."""
    search = result.search
    if search is None or search.final is None or search.reported_model is None:
        return
    fitted = dict(zip([c.name for c in search.final.coordinates], search.final.at, strict=True))
    for finding in result.effects:
        true = true_size(which, finding.name)
        if math.isnan(true):
            continue
        coordinate = next(c for c in search.effects if c.name == finding.name)
        first, (low, high) = coordinate.value(float(fitted[finding.name])), finding.interval
        yield Reported(
            finding.name, "friction" in finding.name, abs(first / true - 1.0),
            abs(finding.value / true - 1.0), 0.5 * (high - low) / abs(finding.value),
            low <= true <= high, search.reported_model.estimates[finding.name].p_value,
        )  # fmt: skip


def off(which: Case, result: Result) -> Iterator[float]:
    """Yield the error of each ordinary parameter, in standard deviations of its interval."""
    real = machine(which)
    for name, refit in result.parameters.items():
        if name in ORDINARY and refit.high > refit.low:
            deviation = 0.5 * (refit.high - refit.low) / NORMAL_95
            yield (refit.refitted - ORDINARY[name](real)) / deviation


def report(effects: Sequence[Reported], deviations: Sequence[float]) -> list[str]:
    """Return the medians, and how many are inside."""
    lines = []
    for kind, some in (("friction", [e for e in effects if e.friction]), ("all", effects)):
        if some:
            fitted, reported, width = (
                float(np.median([getattr(e, key) for e in some]))
                for key in ("fitted", "reported", "width")
            )
            lines.append(f"{kind}: {len(some)} effects, median error {fitted:.2%} fitted, "
                         f"{reported:.2%} reported, half width {width:.2%}, "
                         f"{sum(e.inside for e in some)} inside")  # fmt: skip
    if len(deviations):
        size, inside = np.abs(deviations), np.abs(deviations) < NORMAL_95
        lines.append(f"{len(size)} ordinary parameters: off by {np.sqrt(np.mean(size**2)):.2f} "
                     f"deviations (root mean square), {np.mean(inside):.1%} inside")  # fmt: skip
    return lines


def main() -> None:
    """Print the errors for each machine, and the medians."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "cases", nargs="+", type=short_cases, help="such as medium-572, or pairs-572:15@axis"
    )
    effects: list[Reported] = []
    deviations: list[float] = []
    for which in (c for some in options.parse_args().cases for c in some):
        learn, check = campaign(which)
        result = identify(load([which.bench.config]), learn, check, cache=CACHE)
        named = list(values(which, result))
        effects += named
        if judge(which, from_result(result, 0.0)).exact and not which.foreign:
            deviations += off(which, result)
        for e in named:
            print(f"{which.name:16} {e.name:26} fitted {e.fitted:7.2%}, reported {e.reported:7.2%} "
                  f"+- {e.width:7.2%}{'' if e.inside else ' MISSED'}, sizes apart by chance "
                  f"{e.p_value:.1e}", flush=True)  # fmt: skip
    print("\n".join(report(effects, deviations)))


if __name__ == "__main__":
    main()
