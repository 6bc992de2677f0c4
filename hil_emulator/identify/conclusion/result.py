"""What identification found, as a person and as a program read it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hil_emulator.identify.disagreement.regions import Disagreement
from hil_emulator.identify.disagreement.residuals import SHOWN, Map
from hil_emulator.identify.experiment_design.next_experiment import NextExperiment
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.selection.progress import Search
from hil_emulator.units import show

if TYPE_CHECKING:
    from hil_emulator.identify.conclusion.effect_table import Table

Verdict = Literal[
    "missing_effects", "nothing_missing", "unknown_effect", "cannot_examine", "agrees", "disagrees"
]
"""The last two are those of a gap that was measured without a search."""


def rounded(value: float, unit: str, shown: str) -> str:
    """Return a value for people, in as many digits as an estimate deserves."""
    return show(float(f"{value:.4g}"), unit, shown)


@dataclass(frozen=True)
class Rival:
    """An effect that was weighed and not named.

    Attributes:
        name: the effect.
        gain: gain in chi-square on the training data.
        held_out: the same on the validation data; None without any.
        lost: why it was not named.

    """

    name: str
    gain: float
    held_out: float | None
    lost: str


@dataclass(frozen=True)
class Finding:
    """A missing effect.

    Attributes:
        name: `effect`, or `channel.effect` of a sensor.
        knob: the parameter that was fitted.
        value: its value [unit].
        unit: SI unit.
        shown: the unit for people.
        interval: 95 % confidence interval [unit].
        explained: share of the explained gap that this effect carries.
        gain: gain in chi-square on the training data.
        held_out: the same on the validation data; None without any.
        group: effects that these data cannot tell from it, or that explain nearly as much where
            none of their laws fits.
        form_differs: whether its law is of another form than the catalogue's.
        form: what says so, in words.
        rivals: what else was weighed.
        separating_size: size [unit] at which the nearest rival would separate; None without rivals.

    """

    name: str
    knob: str
    value: float
    unit: str
    shown: str
    interval: tuple[float, float]
    explained: float
    gain: float
    held_out: float | None
    group: tuple[str, ...]
    form_differs: bool
    rivals: tuple[Rival, ...]
    separating_size: float | None = None
    form: str = ""

    def __str__(self) -> str:
        low, high = (rounded(v, self.unit, self.shown) for v in self.interval)
        whose = f"{self.knob} of {self.name}" if self.group else self.knob
        law = ", by a law of another form" if self.form_differs else ""
        value = rounded(self.value, self.unit, self.shown)
        return f"{self.names}{law}: {whose} = {value} (95 %: {low} ... {high})"

    @property
    def names(self) -> str:
        """The effect and what it may be instead, in words."""
        return " or ".join((self.name, *self.group))


@dataclass(frozen=True)
class Unexplained:
    """A significant term that no effect explains.

    Attributes:
        balance: where it sits.
        driver: what it depends on.
        unit: unit of the term.
        knots: values of the driver.
        curve: what the model lacks there: the term that would have to be added.
        shape: the curve in words.
        statistic: gain in chi-square.

    """

    balance: str
    driver: str
    unit: str
    knots: tuple[float, ...]
    curve: tuple[float, ...]
    shape: str
    statistic: float


@dataclass
class Result:
    """The outcome.

    Attributes:
        verdict: in one word.
        reason: the verdict in a sentence.
        effects: the missing effects, the first found first.
        unknown: what remains and is not explained.
        nearest: the effect that explains a part of it, but by another law; "" without one.
        gap: by channel, {"training": {"before", "after", "floor", ...}, "validation": ...}, root
            mean square in `measure` and in percent of the channel's spread, one step ahead and
            (prefix `free_`) in free runs of 500 ms; see `gap.measure`.
        motion: by channel and region of motion, the free run before, after and its floor, held-out
            where there are such data.
        where: the balances that the configured model does not meet, and in which regions.
        remaining: the same of the final model.
        maps: what the worst balances lack over what it depends on, before and after.
        measure: what the gap is counted in.
        parameters: ordinary parameters, configured and refitted [SI].
        unseen: effects that these data cannot show.
        next_experiment: what to record next, in words; empty if nothing is needed.
        plan: the same with its numbers; None if nothing is needed or could be forecast.
        notes: what was found in the data.
        digests: by experiment, the digest of the file it comes from, or "".
        held_out: experiments that took no part in the fit.
        ladder: per accepted effect: name, beside which other one it was judged if beside any,
            gain in chi-square on training and on validation data.
        search: the search itself.
        traces: by experiment and channel, see `gap.traces`.
        interrupted: whether the user ended the search before it was complete.
        added: the strongest unexplained term as an effect file; None without one, or where the
            model has no place for it.
        settled: coordinates of the ordinary parameters in the model with everything found.

    """

    verdict: Verdict
    reason: str
    effects: list[Finding] = field(default_factory=list)
    unknown: list[Unexplained] = field(default_factory=list)
    nearest: str = ""
    gap: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    measure: str = ""
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)
    unseen: list[str] = field(default_factory=list)
    next_experiment: str = ""
    plan: NextExperiment | None = None
    notes: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    held_out: list[str] = field(default_factory=list)
    ladder: list[dict[str, Any]] = field(default_factory=list)
    search: Search | None = None
    traces: dict[str, dict[str, Array]] = field(default_factory=dict)
    motion: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    where: list[Disagreement] = field(default_factory=list)
    remaining: list[Disagreement] = field(default_factory=list)
    maps: list[Map] = field(default_factory=list)
    interrupted: bool = False
    added: "Table | None" = None
    settled: Array = field(default_factory=lambda: np.zeros(0))

    def to_dict(self) -> dict[str, Any]:
        """Return what goes into `result.json`."""
        return {
            "verdict": self.verdict,
            "reason": self.reason,
            "effects": [_finding(f) for f in self.effects],
            "unknown": [vars(u) for u in self.unknown],
            "nearest": self.nearest,
            "gap": self.gap,
            "gap_measure": self.measure,
            "free_run_by_motion": self.motion,
            "where": [_where(d) for d in self.where],
            "remaining": [_where(d) for d in self.remaining],
            "parameters": self.parameters,
            "unseen": self.unseen,
            "next_experiment": self.next_experiment,
            "plan": self.plan.to_dict() if self.plan else None,
            "notes": self.notes,
            "data": self.digests,
            "held_out": self.held_out,
            "ladder": self.ladder,
            "interrupted": self.interrupted,
        }


def _finding(finding: Finding) -> Mapping[str, Any]:
    plain = dict(vars(finding))
    plain["rivals"] = [vars(r) for r in finding.rivals]
    return plain


def _where(disagreement: Disagreement) -> Mapping[str, Any]:
    return {**vars(disagreement), "regions": [vars(r) for r in disagreement.regions]}


def in_words(driver: str, knots: Array, curve: Array, unit: str) -> str:
    """Describe a curve over its driver: how large, odd or even, rising or falling."""
    size = float(np.max(np.abs(curve)))
    if size == 0.0:
        return "zero"
    factor, shown = SHOWN.get(unit, (1.0, unit))
    return f"up to {size * factor:.3g} {shown}, {_parity(driver, knots, curve)}"


def _parity(driver: str, knots: Array, curve: Array) -> str:
    """Return a curve's symmetry about zero, or its trend where the driver keeps its sign."""
    steps = np.diff(curve)
    trend = ""
    if np.all(steps >= 0.0) or np.all(steps <= 0.0):
        trend = ", rising" if curve[-1] > curve[0] else ", falling"
    reach = min(-knots[0], knots[-1])
    if reach < 0.3 * max(-knots[0], knots[-1]):
        return f"{trend.removeprefix(', ') or 'bent'} with {driver}"
    grid = np.linspace(0.05, 1.0, 20) * reach
    right, left = np.interp(grid, knots, curve), np.interp(-grid, knots, curve)
    odd, even = float(np.sum((right - left) ** 2)), float(np.sum((right + left) ** 2))
    share = odd / max(odd + even, 1e-300)
    kind = "odd" if share > 0.8 else "even" if share < 0.2 else "neither odd nor even"
    return f"{kind} in {driver}{trend}"
