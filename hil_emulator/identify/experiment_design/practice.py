"""Practice: experiments from a simulated machine with hidden effects.

The machine is the emulator's model. Its ordinary parameters deviate from the configuration as
those of real machines do, the valve's null drifts, the supply ripples, and instruments have white
and coloured noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design.closed_loop import Disturbances, SimulatedBench
from hil_emulator.identify.experiment_design.library import (
    Target,
    limits,
    stimulus,
    target,
)
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.tuning import NULL_DRIFT
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.plant.rating import largest_current
from hil_emulator.identify.selection.scan import scan
from hil_emulator.units import show, to_si

INSTRUMENTS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
"""Channels of a usual bench, without velocity and spool."""

SIZES = {"small": 0.35, "medium": 1.0, "large": 2.5}
"""Sizes of an effect over its typical value."""

TRAINING = ("multisine", "steps", "triangles", "chirp")
VALIDATION = ("fast_multisine", "pseudo_random", "ramp_and_hold")

PARAMETER_DEVIATION = 1.0
"""Largest deviation of an ordinary parameter, in standard deviations of its prior."""

COLOURED = 0.3
"""Part of the noise's power that is correlated in time (assumed)."""

FAIR_DELTA_CHI2 = 50.0
"""Least gain in chi-square of an effect that is drawn at random."""

TRUTH_STEP = 2e-5
"""Integration step [s], far below that of the identification."""


@dataclass(frozen=True)
class Hidden:
    """One hidden effect: where it acts, and its knob's value in SI."""

    coordinate: Coordinate
    value: float

    def __str__(self) -> str:
        c = self.coordinate
        return f"{c.name}: {knob_of(c)} = {show(self.value, c.unit, c.shown)}"


@dataclass(frozen=True)
class Ground:
    """A machine with hidden effects.

    Attributes:
        model: the plain configuration.
        hidden: the effects.
        ordinary: deviation of each ordinary parameter, in standard deviations, by name.
        seed: of all random numbers.

    """

    model: PlantModel
    hidden: tuple[Hidden, ...]
    ordinary: dict[str, float]
    seed: int

    @property
    def machine(self) -> SimulatedBench:
        """The machine on its bench."""
        model = self.model
        nuisances = parameters.ordinary(model)
        at = [self.ordinary[c.name] for c in nuisances]
        par, chan = model.memory(nuisances, at)
        for h in self.hidden:
            sensor, i = model.index(h.coordinate)
            (chan if sensor else par)[i] = h.value
        world = Disturbances(
            NULL_DRIFT * largest_current(model.plant_values), coloured=COLOURED,
            noise=_stated(model, "noise"), resolution=_stated(model, "resolution"),
        )  # fmt: skip
        return SimulatedBench(model, par, chan, world, INSTRUMENTS, TRUTH_STEP)

    def record(self, made: Target, number: int, name: str) -> Experiment:
        """Play an experiment; the number chooses drift and noise."""
        return self.machine.record(made, self.seed + 1000 * (number + 1), name)


def knob_of(coordinate: Coordinate) -> str:
    """Return the name of a coordinate's parameter."""
    return coordinate.effect.knob.name if coordinate.effect else coordinate.name


def _stated(model: PlantModel, name: str) -> dict[str, float]:
    """Return the knob of a transducer effect by channel, if the configuration states it."""
    effect = next(e for e in model.effects if e.name == name)
    field = effect.field_of(effect.knob)
    return {c: v[field] for c, v in model.config.sensors.items() if field in v}


def hideable(model: PlantModel) -> dict[str, Coordinate]:
    """Return the effects that can be hidden, by name: all that an identification can name."""
    return {c.name: c for c in parameters.candidates(model, INSTRUMENTS)}


def hide(model: PlantModel, name: str, size: str) -> Hidden:
    """Return an effect to hide.

    Args:
        model: the plain configuration.
        name: an effect, or `channel.effect`.
        size: small, medium or large, or the knob's value with its unit.

    Raises:
        UserError: if there is no such effect, or the size is outside its bounds.

    """
    available = hideable(model)
    if name not in available:
        near = sorted(n for n in available if n.rpartition(".")[2] == name)
        hint = (
            f"; did you mean {' or '.join(near)}" if near else f"; there are {', '.join(available)}"
        )
        raise UserError(f"{name}: cannot be hidden in this configuration{hint}")
    c = available[name]
    value = c.value(SIZES[size]) if size in SIZES else _value(c, size)
    if not c.low <= value <= c.high:
        low, high = (show(v, c.unit, c.shown) for v in (c.low, c.high))
        raise UserError(f"{name}: {show(value, c.unit, c.shown)} is outside {low} ... {high}")
    return Hidden(c, value)


def _value(c: Coordinate, size: str) -> float:
    number = float(size) if c.unit == "1" and "%" not in size else size
    try:
        return to_si(number, c.unit, difference=bool(c.effect and c.effect.knob.difference))
    except ValueError:
        usual = show(c.value(1.0), c.unit, c.shown)
        raise UserError(
            f'{c.name}: unknown size "{size}"; take small, medium or large, or a {knob_of(c)} such '
            f'as "{usual}"'
        ) from None


def ground(model: PlantModel, hidden: Sequence[Hidden], seed: int) -> Ground:
    """Return a machine that deviates from its configuration, with effects hidden in it."""
    random = np.random.default_rng(seed)
    drawn = {c.name: float(random.uniform(-PARAMETER_DEVIATION, PARAMETER_DEVIATION))
             for c in parameters.ordinary(model)}  # fmt: skip
    return Ground(model, tuple(hidden), drawn, seed)


def campaign(
    made: Ground, names: Sequence[str], duration: float | None = None, first: int = 0
) -> list[Experiment]:
    """Return recordings of experiments of the library."""
    allowed = limits(made.model.plant_values)
    played = [target(stimulus(n), allowed, duration=duration, seed=made.seed % 1000 + first + i)
              for i, n in enumerate(names)]  # fmt: skip
    return [made.record(t, first + i, t.stimulus.name) for i, t in enumerate(played)]


def surprise(model: PlantModel, size: str, seed: int) -> Hidden:
    """Draw an effect that the experiments of the library show.

    A healthy machine is recorded and every effect is scored on it with the ordinary parameters
    projected out. Effects that these parameters could explain are not drawn.
    """
    healthy = ground(model, (), seed)
    fitter = Fitter(Observer(model, INSTRUMENTS), campaign(healthy, TRAINING))
    nuisances = parameters.ordinary(model) + parameters.usual(model)
    fitter.freeze(nuisances, np.zeros(len(nuisances)))
    base = fitter.fit(nuisances, np.zeros(len(nuisances)), 2)
    fitted = {c.name for c in nuisances}
    scores = scan(fitter, base, [c for n, c in hideable(model).items() if n not in fitted])
    factor = SIZES.get(size, 1.0)
    fair = sorted(s.coordinate.name for s in scores if s.information * factor**2 > FAIR_DELTA_CHI2)
    return hide(model, str(np.random.default_rng(seed + 1).choice(fair)), size)
