"""Findings of a search: missing effects with their rivals, and unexplained terms."""

import math
from dataclasses import dataclass

import numpy as np

from hil_emulator.config.datasheet import SheetQuantity
from hil_emulator.identify.disagreement.residuals import shown_as
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.units import read_as, show

UNEVEN = 0.1
"""Asymmetry of an interval from which both ends are shown: distance of the value from the middle
relative to half the width (assumed)."""


def rounded(value: float, unit: str, shown: str) -> str:
    """Return a value as text with four significant digits."""
    number, blank, written = show(value, unit, shown).partition(" ")
    digits = f"{float(f'{float(number):.4g}'):.6g}" if math.isfinite(value) else number
    return f"{digits}{blank}{written}"


_OFF_THE_AXIS = ("supply", "tank", "valve", "driver", "lines")
"""Tables whose lengths and speeds are not those of the moved axis."""


def shown_unit(c: Coordinate) -> str:
    """Return the unit in which people read a parameter: that of a turned axis in rad, N m."""
    return c.shown if c.place in _OFF_THE_AXIS else read_as(c.unit, c.shown or c.unit)


TOLERANCE = 0.1
"""Relative change from which an ordinary parameter is reported as moved (assumed: the tolerance of
a data sheet)."""


@dataclass(frozen=True)
class Refitted:
    """A parameter of the configuration that was estimated together with the effects.

    Attributes:
        configured: its value in the configuration [unit].
        refitted: its value in the final model [unit].
        low: lower end of its 95 % interval [unit].
        high: upper end of its 95 % interval [unit].
        unit: SI unit.
        shown: the unit in which reports show it.
        sheet: the quantity of a data sheet by which the configuration states it, and in which
            reports show it; null if that is the parameter itself.

    """

    configured: float
    refitted: float
    low: float
    high: float
    unit: str
    shown: str
    sheet: SheetQuantity | None = None

    @property
    def change(self) -> float:
        """Relative change from the configured value, as it is shown; 0 if that is zero."""
        ratio = self.refitted / self.configured if self.configured else 1.0
        return float(ratio ** (self.sheet.power if self.sheet else 1.0)) - 1.0

    @property
    def moved(self) -> bool:
        """Whether the change exceeds the tolerance, and not by chance."""
        return abs(self.change) > TOLERANCE and not self.low <= self.configured <= self.high

    def words(self, value: float) -> str:
        """Return a value as text."""
        if self.sheet:
            return rounded(self.sheet.of(value), self.sheet.unit, self.sheet.shown)
        return rounded(value, self.unit, self.shown)

    def called(self, name: str) -> str:
        """Return the name of what `words` shows, for the name of the parameter."""
        return self.sheet.name if self.sheet else name


@dataclass(frozen=True)
class Rival:
    """A rival: an effect that was examined and not named.

    Attributes:
        name: the effect.
        delta_chi2: gain in chi-square on the training data.
        held_out: gain in chi-square on the validation data; null without any.
        lost: why it was not named.

    """

    name: str
    delta_chi2: float
    held_out: float | None
    lost: str


@dataclass(frozen=True)
class ExperimentEstimate:
    """Estimate of an effect from one experiment, all other parameters fixed at their final values.

    Attributes:
        experiment: its name.
        size: its estimate relative to the reported value.
        deviation: standard deviation of `size`.

    """

    experiment: str
    size: float
    deviation: float


@dataclass(frozen=True)
class Finding:
    """A missing effect.

    Attributes:
        name: `effect`, or `channel.effect` of a sensor.
        knob: the parameter that was fitted.
        value: its value [unit].
        unit: SI unit.
        shown: the unit in which reports show it.
        interval: 95 % confidence interval [unit].
        explained: share of the squared error that this effect explains: error of the configured
            model one step ahead on the training data.
        delta_chi2: gain in chi-square on the training data.
        held_out: gain in chi-square on the validation data; null without any.
        group: effects that these data do not distinguish from it, or that explain nearly as much
            if no law fits exactly.
        form_differs: whether its law is of another form than the catalogue's.
        form: the evidence of another form, in words.
        words: the effect in words.
        rivals: the other effects that were examined.
        separating_size: size [unit] from which the nearest rival could be distinguished; null
            without rivals, or if no size suffices.
        by_experiment: the estimate of each experiment, the held-out ones last; of each part of an
            experiment if there are fewer than three.

    """

    name: str
    knob: str
    value: float
    unit: str
    shown: str
    interval: tuple[float, float]
    explained: float
    delta_chi2: float
    held_out: float | None
    group: tuple[str, ...]
    form_differs: bool
    rivals: tuple[Rival, ...]
    separating_size: float | None = None
    form: str = ""
    words: str = ""
    by_experiment: tuple[ExperimentEstimate, ...] = ()

    def __str__(self) -> str:
        low, high = (rounded(v, self.unit, self.shown) for v in self.interval)
        whose = f"{self.knob} of {self.name}" if self.group else self.knob
        law = ", by a law of another form" if self.form_differs else ""
        value = rounded(self.value, self.unit, self.shown)
        return f"{self.names}{law}: {whose} = {value} (95 %: {low} ... {high})"

    @property
    def share(self) -> str:
        """The explained share as text; never "0 %"."""
        return "less than 1 %" if self.explained < 0.01 else f"{100 * self.explained:.0f} %"

    @property
    def size(self) -> str:
        """Value and interval: "6.8 +- 0.9 mm^2"; both ends of an asymmetric interval."""
        low, high = self.interval
        half = 0.5 * (high - low)
        if not abs(0.5 * (low + high) - self.value) <= UNEVEN * half:
            ends = " to ".join(rounded(end, self.unit, self.shown) for end in (low, high))
            return f"{rounded(self.value, self.unit, self.shown)} ({ends})"
        number, _, unit = show(self.value, self.unit, self.shown).partition(" ")
        doubt = float(show(half, self.unit, self.shown).partition(" ")[0])
        digits = 1 - math.floor(math.log10(doubt)) if doubt > 0.0 else 6
        return f"{round(float(number), digits):g} +- {round(doubt, digits):g} {unit}".rstrip()

    @property
    def names(self) -> str:
        """The effect and those that are not distinguished from it, in words."""
        return " or ".join((self.name, *self.group))


@dataclass(frozen=True)
class Unexplained:
    """A significant term that no effect explains.

    Attributes:
        balance: the balance in which it is missing.
        regressor: the quantity on which it depends.
        unit: unit of the term.
        knots: values of the driver.
        curve: the missing term at these values, in the unit of the term.
        shape: the curve in words.
        statistic: gain in chi-square.

    """

    balance: str
    regressor: str
    unit: str
    knots: tuple[float, ...]
    curve: tuple[float, ...]
    shape: str
    statistic: float


def in_words(regressor: str, knots: Array, curve: Array, unit: str) -> str:
    """Describe a curve over its regressor: size, symmetry and trend."""
    size = float(np.max(np.abs(curve)))
    if size == 0.0:
        return "zero"
    factor, shown = shown_as(unit)
    return f"up to {size * factor:.3g} {shown}, {_parity(regressor, knots, curve)}"


def _parity(regressor: str, knots: Array, curve: Array) -> str:
    """Return a curve's symmetry about zero, or its trend where the regressor keeps its sign."""
    steps = np.diff(curve)
    trend = ""
    if np.all(steps >= 0.0) or np.all(steps <= 0.0):
        trend = ", rising" if curve[-1] > curve[0] else ", falling"
    reach = min(-knots[0], knots[-1])
    if reach < 0.3 * max(-knots[0], knots[-1]):
        return f"{trend.removeprefix(', ') or 'bent'} with {regressor}"
    grid = np.linspace(0.05, 1.0, 20) * reach
    right, left = np.interp(grid, knots, curve), np.interp(-grid, knots, curve)
    odd, even = float(np.sum((right - left) ** 2)), float(np.sum((right + left) ** 2))
    share = odd / max(odd + even, 1e-300)
    kind = "odd" if share > 0.8 else "even" if share < 0.2 else "neither odd nor even"
    return f"{kind} in {regressor}{trend}"
