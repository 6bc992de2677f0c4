"""Do the named effects close the gap? Held-out free runs, compared with those of the true model.

    python -m tests.studies.accuracy.freerun_study --cases medium:12 --duration 2

The true model is the catalogue's, with the hidden effect at its true size and the ordinary
parameters refitted to the same training data. A case counts as closed if the
identified model leaves at most 1.05 times the error of the true model on the validation data.
"""

import argparse
import time
from collections.abc import Iterator

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.disagreement.gap import Gap, compare, measure
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, KNEE
from tests.studies.generator.cases import Case, campaign, case, cases
from tests.studies.generator.effects import EFFECTS
from tests.studies.study import counts
from tests.studies.tables import wilson

CLOSED = 1.05
"""Most that the found model may leave, over what the true one leaves."""


def true_model(model: PlantModel, observer: Observer, which: Case, searcher: Searcher) -> Fit:
    """Return the catalogue's model with the hidden effects at their true sizes, refitted."""
    by_name = {c.name: c for c in parameters.candidates(model, observer.channels)}
    hidden = [(by_name[EFFECTS[k].name], EFFECTS[k].knob(v)) for k, v in which.effects.items()]
    for coordinate, value in hidden:
        set_to(model, coordinate, value)
    free = [c for c in parameters.ordinary(model) if c.name not in dict(hidden_names(hidden))]
    return converge(searcher.fitter, free, np.zeros(len(free)))


def hidden_names(hidden: list[tuple[Coordinate, float]]) -> Iterator[tuple[str, float]]:
    """Yield the names of what is hidden."""
    yield from ((c.name, value) for c, value in hidden)


def set_to(model: PlantModel, coordinate: Coordinate, value: float) -> None:
    """Give a model's parameter a value."""
    sensor, i = model.index(coordinate)
    (model.chan if sensor else model.par)[i] = value


def left(gap: Gap, when: str) -> np.ndarray:
    """Return what is left in the held-out free run by channel, in units of noise."""
    return np.array([parts["validation"][f"free_{when}"] for parts in gap.values()])


def examine(which: Case) -> dict[str, object]:
    """Return what the found and the true model leave in one case."""
    train, held = campaign(which)
    begin = time.process_time()
    result = identify(load([KNEE]), train, held, cache=CACHE)
    model = PlantModel(load([KNEE]), CACHE)
    observer = Observer(model, tuple(result.gap))
    searcher = Searcher(observer, train, held, [], parameters.ordinary(model))
    fit = true_model(model, observer, which, searcher)
    reference = measure(observer, compare(observer, fit, fit, train, held))
    true = left(reference, "after")
    return {
        "named": [f.name for f in result.effects], "channels": list(result.gap),
        "before": left(result.gap, "before"), "after": left(result.gap, "after"),
        "floor": left(result.gap, "floor"), "true": true,
        "seconds": time.process_time() - begin,
    }  # fmt: skip


def pooled(values: np.ndarray) -> float:
    """Return the root mean square over channels."""
    return float(np.sqrt(np.mean(values**2)))


def share(hits: int, of: int) -> str:
    """Return a share with its 95 % interval."""
    low, high = wilson(hits, of)
    return f"{hits}/{of} (95 %: {low:.2f} ... {high:.2f})"


def line(which: Case, row: dict[str, object]) -> str:
    """Return one case in a line: per channel before > after (true, floor)."""
    parts = [
        f"{c[:10]} {b:.1f}>{a:.2f} ({t:.2f}, {f:.2f})"
        for c, b, a, t, f in zip(
            *(row[k] for k in ("channels", "before", "after", "true", "floor")), strict=True
        )
    ]  # fmt: skip
    return f"{which.name:10s} {'+'.join(which.effects):22s} {row['named']}  {'; '.join(parts)}"


def main() -> None:
    """Run the cases and print the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--cases", default="medium:12", help="as in the study of names")
    options.add_argument("--case", nargs="*", default=[], help="single cases, like medium-07")
    options.add_argument("--duration", type=float, default=2.0, help="of each experiment [s]")
    chosen = options.parse_args()
    named = [name.rpartition("-") for name in chosen.case]
    wanted = [case(group, int(number), chosen.duration) for group, _, number in named]
    wanted = wanted or list(cases(counts(chosen.cases), chosen.duration))
    overall, every, floors = [], [], []
    for which in wanted:
        row = examine(which)
        print(line(which, row), f"{row['seconds']:.0f} s", flush=True)
        after, true, floor = (np.asarray(row[k]) for k in ("after", "true", "floor"))
        overall.append(pooled(after) / pooled(true))
        every.append(float(np.max(after / true)))
        floors.append(pooled(floor) / pooled(true))
    for words, ratios in (("all channels", overall), ("the worst channel", every)):
        hits = sum(r <= CLOSED for r in ratios)
        print(f"closed, {words}: {share(hits, len(ratios))}, median {np.median(ratios):.3f}")
    print(f"floor over what the true model leaves: median {np.median(floors):.2f}, "
          f"{min(floors):.2f} ... {max(floors):.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
