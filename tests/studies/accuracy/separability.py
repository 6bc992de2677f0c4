"""Forecasts of experiments against what the blind plant then really shows.

    python -m tests.studies.accuracy.separability --seed 1 --cases 20

A case is one effect of the blind plant in one short recording, of the size at which it just shows,
and its nearest rival; their class is ambiguous where a refit gains little. Every experiment of the
library is forecast, then really recorded on the blind plant; what a joint refit of both
explanations gains there is compared with the forecast.
"""

import argparse
import math
import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import spearmanr

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design import forecast
from hil_emulator.identify.experiment_design.forecast import Explanation, Forecaster
from hil_emulator.identify.experiment_design.library import LIBRARY, Target, limits, target
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.parallel.pool import LocalBatch
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.levels import DISTINGUISHABLE, needed_delta_chi2
from hil_emulator.identify.selection.rivals import separability
from hil_emulator.identify.selection.scan import Score, scan
from tests.identify.rig_data import knee_model
from tests.studies.generator.bench import record
from tests.studies.generator.cases import Case, machine, seed
from tests.studies.generator.effects import EFFECTS
from tests.studies.generator.sensors import CHANNELS
from tests.studies.tables import wilson

SHOWS = 60.0
"""Gain in chi-square in the first recording for which an effect's size is chosen."""

REFITTED = 3
"""Rivals that are refitted to find the nearest."""

JOINT = 5
"""Iterations of a joint refit."""

GOOD = 0.8
"""Part of the best margin that a recommendation has to reach."""


@dataclass(frozen=True)
class Outcome:
    """One case: forecasts and realised margins, by experiment of the library."""

    effect: str
    rival: str
    now: float
    predicted: np.ndarray
    realised: np.ndarray

    @property
    def share(self) -> float:
        """Part of the best margin that the recommended experiment reached."""
        return float(self.realised[self.recommended] / np.max(self.realised))

    @property
    def recommended(self) -> int:
        """Index of the experiment with the best forecast."""
        return int(np.argmax(self.predicted))


class Bench:
    """One machine of the blind plant, seen through the configured model."""

    def __init__(self, key: str, number: int, first: str) -> None:
        self.key, self.first = key, first
        self.model: PlantModel = knee_model()
        self.observer = Observer(self.model, CHANNELS)
        size = EFFECTS[key].medium / 3.0
        self.case = Case(f"separability-{number:03d}", {key: size}, False, False, 2.0)
        self.nuisances = parameters.ordinary(self.model)

    def sized(self, factor: float) -> None:
        """Scale the hidden effect."""
        effects = {k: v * factor for k, v in self.case.effects.items()}
        self.case = replace(self.case, effects=effects)

    def recorded(self, kind: str, number: int, played: Target | None = None) -> Experiment:
        """Return a recording of the blind plant."""
        path = None if played is None else played.position
        lasts = 2.0 if path is None else len(path) * 1e-3
        return record(machine(self.case), dict(self.case.effects), kind,
                      (seed(self.case.name), number), lasts, False, path)  # fmt: skip

    def scored(self) -> tuple[Fitter, Fit, list[Score]]:
        """Return fitter, fit and scores of the first recording without any effect."""
        fitter = Fitter(self.observer, [self.recorded(self.first, 0)])
        at = np.zeros(len(self.nuisances))
        for _ in range(2):
            fitter.freeze(self.nuisances, at)
            base = fitter.fit(self.nuisances, at, 3)
            at = base.at
        return fitter, base, scan(fitter, base, parameters.candidates(self.model, CHANNELS))

    def explained(self, fitter: Fitter, base: Fit, score: Score, *sizes: float) -> Explanation:
        """Return one effect's best fit to the first recording from several sizes."""
        free = [*self.nuisances, score.coordinate]
        fits = [fitter.fit(free, np.append(base.at, size), 5) for size in sizes]
        fit = min(fits, key=lambda f: f.chi2)
        return Explanation(score.coordinate.name, free, fit.at, fit.chi2)

    def size(self, score: Score) -> float:
        """Return the hidden effect as the coordinate of the catalogue's knob."""
        c, hidden = score.coordinate, EFFECTS[self.key]
        value = hidden.knob(self.case.effects[self.key])
        return c.at(value)


def nearest(scores: list[Score], mine: Score, size: float) -> list[tuple[float, Score]]:
    """Return the rivals by their separability at the hidden size, the nearest first."""
    rest = [s for s in scores if s is not mine]
    return sorted(((separability(mine, s, size), s) for s in rest), key=lambda p: p[0])


@dataclass(frozen=True)
class Beginning:
    """The first recording and the two explanations of it."""

    fitter: Fitter
    truth: Explanation
    rival: Explanation
    delta_chi2: float

    @property
    def apart(self) -> float:
        """By how much the rival explains less."""
        return self.rival.chi2 - self.truth.chi2


def begun(bench: Bench) -> Beginning:
    """Record the first experiment, and fit the hidden effect and its nearest rivals."""
    name = EFFECTS[bench.key].name
    fitter, base, scores = bench.scored()
    mine = next(s for s in scores if s.coordinate.name == name)
    delta_chi2 = base.chi2 - bench.explained(fitter, base, mine, bench.size(mine)).chi2
    bench.sized(float(np.clip(math.sqrt(SHOWS / max(delta_chi2, 1.0)), 0.1, 3.0)))
    fitter, base, scores = bench.scored()
    mine = next(s for s in scores if s.coordinate.name == name)
    truth = bench.explained(fitter, base, mine, bench.size(mine))
    rivals = [bench.explained(fitter, base, s, s.estimate)
              for _, s in nearest(scores, mine, bench.size(mine))[:REFITTED]]  # fmt: skip
    rival = min(rivals, key=lambda e: e.chi2)
    fitter.freeze(truth.coordinates, truth.at)
    return Beginning(fitter, truth, rival, base.chi2 - truth.chi2)


def examine(bench: Bench) -> Outcome | Beginning:
    """Run one case; where the effect does not show, return where it ended."""
    first = begun(bench)
    shows = first.delta_chi2 > needed_delta_chi2(len(parameters.candidates(bench.model, CHANNELS)))
    return forecast_and_shown(bench, first) if shows else first


def forecast_and_shown(bench: Bench, first: Beginning) -> Outcome:
    """Forecast every experiment of the library, then record it."""
    asked = Forecaster(first.fitter, bench.observer, [first.truth, first.rival])
    plant = bench.model.plant_values
    played = [target(e, limits(plant)) for e in LIBRARY]
    predicted = [asked.separability_of(first.truth, t) for t in played]
    realised = [shown(bench, first.fitter, first.truth, first.rival, t, i)
                for i, t in enumerate(played)]  # fmt: skip
    return Outcome(
        first.truth.name, first.rival.name, first.apart, np.array(predicted), np.array(realised),
    )  # fmt: skip


def shown(
    bench: Bench, now: Fitter, truth: Explanation, rival: Explanation, played: Target, number: int
) -> float:
    """Return the difference in chi-square after an experiment has really been recorded."""
    kind = "steps" if played.stimulus.jumps else played.stimulus.name
    more = forecast.seen(bench.observer, bench.recorded(kind, 10 + number, played), truth)
    both = Fitter(bench.observer, [*now.experiments, *more.experiments])
    both.batch = LocalBatch(bench.observer, [*now.frozen, *more.frozen])
    left = [both.fit(e.coordinates, e.at, JOINT).chi2 for e in (rival, truth)]
    return left[0] - left[1]


def main() -> None:
    """Run the cases and print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--cases", type=int, default=len(EFFECTS))
    options.add_argument("--first", type=int, default=0, help="number of the first case")
    options.add_argument("--minutes", type=float, default=math.inf, help="start no case after that")
    chosen = options.parse_args()
    outcomes, begin, keys = [], time.process_time(), list(EFFECTS)
    end = time.monotonic() + 60.0 * chosen.minutes
    print("effect                 rival                  now   recommended: forecast shown  "
          "best: shown  share")  # fmt: skip
    for i in range(chosen.first, chosen.first + chosen.cases):
        if time.monotonic() > end:
            break
        first = ("multisine", "triangles")[(i // len(keys) + i) % 2]
        outcome = examine(Bench(keys[i % len(keys)], 1000 * chosen.seed + i, first))
        if isinstance(outcome, Beginning):
            print(
                f"{outcome.truth.name:22s} does not show: gain {outcome.delta_chi2:.0f}", flush=True
            )
            continue
        outcomes.append(outcome)
        print(described(outcome), flush=True)
    report(outcomes)
    print(f"{time.process_time() - begin:.0f} s of one core")


def described(o: Outcome) -> str:
    """Return one line of the table."""
    pick, best = o.recommended, int(np.argmax(o.realised))
    return (
        f"{o.effect:22s} {o.rival:22s} {o.now:5.1f} {LIBRARY[pick].name:15s} "
        f"{o.predicted[pick]:7.0f} {o.realised[pick]:7.0f}  {LIBRARY[best].name:15s} "
        f"{o.realised[best]:7.0f}  {o.share:5.2f}\n    "
        + ", ".join(
            f"{e.name} {p:.0f} {r:.0f}"
            for e, p, r in zip(LIBRARY, o.predicted, o.realised, strict=True)
        )
    )


def report(outcomes: list[Outcome]) -> None:
    """Print how well the forecasts rank, and how good the recommendations are."""
    predicted = np.concatenate([o.predicted for o in outcomes])
    realised = np.concatenate([o.realised for o in outcomes])
    within = [spearmanr(o.predicted, o.realised).statistic
              for o in outcomes]  # fmt: skip
    print(f"Spearman of forecast and shown: {spearmanr(predicted, realised).statistic:.2f} over "
          f"{len(predicted)} pairs of effect and experiment; median within a case "
          f"{np.median(within):.2f}")  # fmt: skip
    print(f"shown over forecast: median {np.median(realised / np.maximum(predicted, 1e-9)):.2f}")
    for words, chosen in (
        ("all", outcomes),
        ("ambiguous class", [o for o in outcomes if abs(o.now) < DISTINGUISHABLE]),
    ):
        good = sum(o.share >= GOOD for o in chosen)
        low, high = wilson(good, len(chosen))
        print(f"{words}: recommended reaches {GOOD:g} of the best in {good}/{len(chosen)}, "
              f"95 % {low:.2f} ... {high:.2f}")  # fmt: skip
    sys.stdout.flush()


if __name__ == "__main__":
    main()
