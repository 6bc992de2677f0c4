"""What identification found, as a person and as a program read it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hil_emulator.identify.experiment import Array
from hil_emulator.identify.next_experiment import NextExperiment
from hil_emulator.identify.regions import Disagreement
from hil_emulator.identify.residuals import Map
from hil_emulator.identify.search import Search
from hil_emulator.units import show

Verdict = Literal[
    "missing_effects", "nothing_missing", "unknown_effect", "cannot_examine", "agrees", "disagrees"
]
"""The last two are those of a gap that was measured without a search."""


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
        group: effects that these data cannot tell from it.
        form_differs: whether its law is of another form than the catalogue's.
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

    def __str__(self) -> str:
        low, high = (show(v, self.unit, self.shown) for v in self.interval)
        text = f"{self.name}: {self.knob} = {show(self.value, self.unit, self.shown)}"
        return f"{text} (95 %: {low} ... {high})"


@dataclass(frozen=True)
class Unexplained:
    """A significant term that no effect explains.

    Attributes:
        balance: where it sits.
        driver: what it depends on.
        unit: unit of the term.
        knots: values of the driver.
        curve: the term there, and -curve is what the model lacks.
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
        ladder: per accepted effect: name, chi-square on training and on validation data.
        search: the search itself.
        traces: by experiment and channel, see `gap.traces`.
        interrupted: whether the user ended the search before it was complete.

    """

    verdict: Verdict
    reason: str
    effects: list[Finding] = field(default_factory=list)
    unknown: list[Unexplained] = field(default_factory=list)
    gap: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    measure: str = ""
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)
    unseen: list[str] = field(default_factory=list)
    next_experiment: str = ""
    plan: NextExperiment | None = None
    notes: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    ladder: list[dict[str, Any]] = field(default_factory=list)
    search: Search | None = None
    traces: dict[str, dict[str, Array]] = field(default_factory=dict)
    motion: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    where: list[Disagreement] = field(default_factory=list)
    remaining: list[Disagreement] = field(default_factory=list)
    maps: list[Map] = field(default_factory=list)
    interrupted: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return what goes into `result.json`."""
        return {
            "verdict": self.verdict,
            "reason": self.reason,
            "effects": [_finding(f) for f in self.effects],
            "unknown": [vars(u) for u in self.unknown],
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
            "ladder": self.ladder,
            "interrupted": self.interrupted,
        }


def _finding(finding: Finding) -> Mapping[str, Any]:
    plain = dict(vars(finding))
    plain["rivals"] = [vars(r) for r in finding.rivals]
    return plain


def _where(disagreement: Disagreement) -> Mapping[str, Any]:
    return {**vars(disagreement), "regions": [vars(r) for r in disagreement.regions]}


def in_words(driver: str, curve: Array, unit: str) -> str:
    """Describe a curve over its driver: odd, even or neither, and how large."""
    size = float(abs(curve).max())
    if size == 0.0:
        return "zero"
    centred = curve - curve.mean()
    odd = float(abs(centred - centred[::-1]).sum() / max(2.0 * abs(centred).sum(), 1e-300))
    kind = "odd" if odd > 0.7 else "even" if odd < 0.3 else "neither odd nor even"
    return f"up to {size:.3g} {unit}, {kind} in {driver}"
