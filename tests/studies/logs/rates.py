"""The same seals at six sample rates.

    python -m tests.studies.logs.rates [SEAL ...] [--rate HZ ...]

Every log is interpolated to the rate, and gets the noise of its sensors at every sample. Identified
from 1 and 5 bar, judged on 3 and 7 bar, and compared with least squares of the right effects.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.data_checks.direction import dissipative
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.benches.force_balance import StaticObserver
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.session import EVERYTHING, Question, identify
from tests.identify.rig_data import CACHE

DATA = Path(__file__).parents[2] / "identify" / "data"
SEALS = ("oring", "napn", "pk")
RATES = (50, 100, 200, 500, 1000, 2000)
SENSORS = {"position": 2e-6, "pressure_a": 200.0, "load_force": 0.025}
"""Standard deviation of the noise of each sensor, from sixth differences of the logs [SI]."""


@dataclass(frozen=True)
class Row:
    """One seal at one rate.

    Attributes:
        seal: which.
        rate: of the samples [Hz].
        result: of identification.
        least_squares: held-out error of the right effects [N].

    """

    seal: str
    rate: int
    result: Result
    least_squares: float

    @property
    def held_out(self) -> float:
        """Held-out error of what was identified [N]."""
        return self.result.gap["load_force"]["validation"]["after"]

    def __str__(self) -> str:
        effects = "; ".join(
            f"{f.name} {f.value:.4g} ({f.interval[0]:.4g} ... {f.interval[1]:.4g})"
            for f in self.result.effects
        )
        ratio = self.held_out / self.least_squares
        return (
            f"{self.seal:6s} {self.rate:5d} Hz  {self.result.verdict:16s} {self.held_out:.3f} N, "
            f"least squares {self.least_squares:.3f} N ({ratio:.2f})  {effects}"
        )


def resampled(e: Experiment, rate: float, seed: int = 0) -> Experiment:
    """Return an experiment at another rate, as noisy at every sample as its sensors are."""
    random = np.random.default_rng(seed)
    old = np.arange(e.samples) * e.period
    new = np.arange(int(old[-1] * rate)) / rate
    nearest = np.minimum(np.round(new / e.period).astype(np.int64), e.samples - 1)
    readings = {}
    for name, values in e.readings.items():
        good = np.isfinite(values)
        between = np.interp(new, old[good], values[good])
        noise = SENSORS[name] * random.standard_normal(len(new))
        readings[name] = np.where(good[nearest], between + noise, np.nan)
    return replace(e, period=1.0 / rate, readings=readings)


def logs(seal: str, rate: float, *bars: int) -> list[Experiment]:
    """Return logs of a seal at some pressures, at a rate."""
    files = [DATA / f"{seal}_{bar}bar.csv" for bar in bars]
    return [resampled(e, rate, i) for i, e in enumerate(load_experiments(files))]


def least_squares(model: PlantModel, training: Sequence[Experiment],
                  validation: Sequence[Experiment]) -> float:  # fmt: skip
    """Return the held-out error of area, Coulomb friction and its growth with pressure [N]."""
    turned = dissipative([*training, *validation], model.plant_values)
    learn, check = turned[: len(training)], turned[len(training) :]
    rows, force = terms(model, learn)
    sizes = np.linalg.lstsq(rows, force, rcond=None)[0]
    rows, force = terms(model, check)
    return float(np.sqrt(np.mean((force - rows @ sizes) ** 2)))


def terms(model: PlantModel, experiments: Sequence[Experiment]) -> tuple[Array, Array]:
    """Return what the force is a sum of, where the rod slides, and the force."""
    observer = StaticObserver(model)
    names = list(model.kernel.state.names or ())
    rows, force = [], []
    for e in experiments:
        frozen = observer.freeze(e, *model.memory([], []))
        s = frozen.states[frozen.present]
        pressure, sign = s[:, names.index("pressure_a")], np.sign(s[:, names.index("velocity")])
        rows.append(np.column_stack([pressure, -sign, -sign * pressure]))
        force.append(frozen.measured[frozen.present, 0])
    return np.vstack(rows), np.concatenate(force)


def examined(seal: str, rate: int, question: Question = EVERYTHING) -> Row:
    """Identify one seal at one rate."""
    config = load([DATA / "friction_rig.toml"])
    training, validation = logs(seal, rate, 1, 5), logs(seal, rate, 3, 7)
    result = identify(config, training, validation, question, cache=CACHE)
    fitted = least_squares(PlantModel(config, CACHE), training, validation)
    return Row(seal, rate, result, fitted)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seals", nargs="*", default=SEALS)
    parser.add_argument("--rate", type=int, nargs="+", default=RATES)
    chosen = parser.parse_args()
    for seal in chosen.seals:
        for rate in chosen.rate:
            print(examined(seal, rate), flush=True)


if __name__ == "__main__":
    main()
