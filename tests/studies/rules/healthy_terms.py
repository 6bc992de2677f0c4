"""Share of the variance that free terms explain in healthy machines: the basis of `NOTICEABLE`.

    python -m tests.studies.rules.healthy_terms none-600:20 none-600:10@axis

Every machine has ripple of its friction and of its supply: true and significant terms. A report of
these would be a false alarm.
"""

import argparse

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.levels import NOTICEABLE
from hil_emulator.identify.selection.search import Searcher
from tests.identify.rig_data import CACHE, INSTRUMENTS
from tests.studies.generator.cases import Case, campaign, short_cases


def largest(which: Case) -> tuple[float, str]:
    """Return the largest share of the variance that a significant term explains, and its title.

    As the product counts: chance set aside, and a term of many hats in proportion less.
    """
    model = PlantModel(load([which.bench.config]), CACHE)
    searcher = Searcher(
        Observer(model, INSTRUMENTS), campaign(which)[0], [], [], parameters.ordinary(model)
    )
    last_round = searcher.look().rounds[-1]
    shares = [(t.surplus * HATS / len(t.knots) / last_round.base.sample_size, t.title)
              for t in last_round.significant]  # fmt: skip
    return max(shares, default=(0.0, ""))


def main() -> None:
    """Print the largest term of each machine, and how they are distributed."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "cases", nargs="+", type=short_cases, help="healthy ones, as none-600 or none-600:20@axis"
    )
    shares, noticed = [], 0
    for which in (c for some in options.parse_args().cases for c in some):
        share, title = largest(which)
        shares.append(share)
        noticed += share > NOTICEABLE
        bench = " ".join(w for w, on in (("wide", which.wide), ("dirty", which.dirty)) if on)
        print(f"{which.name:16} {share:8.4%}  {title} {bench}", flush=True)
    print(f"{len(shares)} machines: median {np.median(shares):.3%}, 90 % below "
          f"{np.quantile(shares, 0.9):.3%}, {noticed} above {NOTICEABLE:.0%}")  # fmt: skip


if __name__ == "__main__":
    main()
