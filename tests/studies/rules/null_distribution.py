"""Gain of the best candidate by chance: a bootstrap of the acceptance statistic.

    python -m tests.studies.rules.null_distribution none-60 none-60@axis

A machine of the blind test with nothing hidden is fitted and its candidates are scored. Then whole
blocks of its residual get random signs (a wild bootstrap by blocks). This removes any effect, and
keeps excitation, instruments and correlation. In the tangent of the fit, each draw takes
milliseconds: of each candidate, the sums of column times residual over time and place are enough.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.levels import FALSE_ALARM, needed_delta_chi2
from hil_emulator.identify.selection.scan import Score, scan
from tests.identify.rig_data import CACHE, INSTRUMENTS
from tests.studies.generator.cases import Case, campaign, short_cases

DRAWS = 4000
"""Of the residual's signs."""

BLOCKS = 2
"""Correlation times in a block whose residuals keep their signs to each other."""


@dataclass(frozen=True)
class Null:
    """What chance makes of one machine's data.

    Attributes:
        best: largest robust statistic of all candidates, of each draw.
        candidates: how many data show.

    """

    best: Array
    candidates: int

    @property
    def needed(self) -> float:
        """What a name needs."""
        return needed_delta_chi2(self.candidates)

    @property
    def alarms(self) -> float:
        """Share of the draws in which a candidate reaches that."""
        return float(np.mean(self.best > self.needed))


def examined(which: Case) -> Null:
    """Return the null distribution of one machine."""
    model = PlantModel(load([which.bench.config]), CACHE)
    fitter = Fitter(Observer(model, INSTRUMENTS), campaign(which)[0])
    free = parameters.ordinary(model)
    base = converge(fitter, free, np.zeros(len(free)))
    scores = scan(fitter, base, parameters.candidates(model, INSTRUMENTS))
    return null_of(fitter, base, [s for s in scores if s.visible])


def null_of(fitter: Fitter, base: Fit, scores: Sequence[Score], seed: int = 0) -> Null:
    """Return the null distribution of the best of some candidates."""
    clusters, rows = fitter.clusters, len(base.residual)
    block = np.arange(rows) // (BLOCKS * clusters.length)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(DRAWS, 1 + block[-1]))
    time = np.arange(rows) // clusters.length
    place = clusters.places - clusters.places.min()
    best = np.zeros(DRAWS)
    for score in scores:
        column = score.column[:rows].astype(np.float64)
        # what the candidate explains of the machine as it is, is no chance
        size = float(column @ base.residual) / float(column @ column)
        products = column * (base.residual - size * column)
        best = np.maximum(best, _statistics(products, signs, block, time, place, column @ column))
    return Null(best, len(scores))


def _statistics(
    products: Array, signs: Array, block: Array, time: Array, place: Array, power: float
) -> Array:
    """Return one candidate's robust statistic of each draw."""
    whole = signs @ np.bincount(block, products)
    in_time = float(np.sum(np.bincount(time, products) ** 2))
    cells = np.zeros((1 + block[-1], 1 + place.max()))
    np.add.at(cells, (block, place), products)
    in_place = np.sum((signs @ cells) ** 2, axis=1) - float(np.sum(cells**2))
    factor = np.maximum(1.0, (in_time + np.maximum(0.0, in_place)) / power)
    return np.asarray(whole**2 / power / factor)


def main() -> None:
    """Print what chance reaches in some machines."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "cases", nargs="+", type=short_cases, help="healthy ones, as none-60 or none-60@axis"
    )
    print("case            candidates  needed  1 in 20  1 in 1000  alarms")
    for which in (c for some in options.parse_args().cases for c in some):
        drawn = examined(which)
        ends = np.quantile(drawn.best, [0.95, 1.0 - FALSE_ALARM])
        print(f"{which.name:15} {drawn.candidates:10}  {drawn.needed:6.1f}  {ends[0]:7.1f}  "
              f"{ends[1]:9.1f}  {drawn.alarms:.4f}")  # fmt: skip


if __name__ == "__main__":
    main()
