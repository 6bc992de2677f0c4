"""What identification found, as a person and as a program read it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hil_emulator.identify.conclusion.effect_table import EffectTable
from hil_emulator.identify.conclusion.findings import Finding, Refitted, Unexplained
from hil_emulator.identify.disagreement.regions import Disagreement
from hil_emulator.identify.disagreement.repeatability import Repeatability
from hil_emulator.identify.disagreement.residuals import Map
from hil_emulator.identify.experiment_design.next_experiment import NextExperiment
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.selection.progress import Search

Verdict = Literal[
    "missing_effects",
    "nothing_missing",
    "unknown_effect",
    "cannot_examine",
    "cannot_tell",
    "agrees",
    "disagrees",
]
"""The last two are those of a gap that was measured without a search."""


@dataclass
class Result:
    """The outcome.

    Attributes:
        verdict: in one word.
        reason: the verdict in a sentence.
        effects: the missing effects, the first found first.
        unknown: what remains and is not explained.
        nearest: the effect that explains a part of it, but by another law, or two that explain as
            much ("fixed_pump or variable_pump"); "" without one.
        hardly_believed: ordinary parameters that hardly any machine has so far off, beside what was
            named, in words: something else is missing as well, or stands in for one of them.
        gap: by channel, {"training": {"before", "after", "floor", ...}, "validation": ...}, root
            mean square in `measure` and in percent of the channel's spread, one step ahead and
            (prefix `free_`) in free runs of 500 ms; see `gap.measure`.
        motion: by channel and region of motion, the free run before, after and its floor, held-out
            where there are such data.
        where: the balances that the configured model does not meet, and in which regions.
        remaining: the same of the final model.
        maps: what the worst balances lack over what it depends on, before and after.
        measure: what the gap is counted in.
        parameters: ordinary parameters by name.
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
        repeats: what the final model leaves that comes again at the same state; None where its
            noise is known.
        plain: value [SI] of every parameter by ordinary least squares, by name; empty where nobody
            asked for it.
        interrupted: whether the user ended the search before it was complete.
        added: the strongest unexplained term as an effect file; None without one, or where the
            model has no place for it.
        final_at: coordinates of the model with everything found, ordinary parameters first.

    """

    verdict: Verdict
    reason: str
    effects: list[Finding] = field(default_factory=list)
    unknown: list[Unexplained] = field(default_factory=list)
    nearest: str = ""
    hardly_believed: list[str] = field(default_factory=list)
    gap: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    measure: str = ""
    parameters: dict[str, Refitted] = field(default_factory=dict)
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
    repeats: Repeatability | None = None
    plain: dict[str, float] = field(default_factory=dict)
    interrupted: bool = False
    added: EffectTable | None = None
    final_at: Array = field(default_factory=lambda: np.zeros(0))

    def to_dict(self) -> dict[str, Any]:
        """Return what goes into `result.json`."""
        return {
            "verdict": self.verdict,
            "reason": self.reason,
            "effects": [_finding(f) for f in self.effects],
            "unknown": [_plain(u) for u in self.unknown],
            "nearest": self.nearest,
            "hardly_believed": self.hardly_believed,
            "gap": self.gap,
            "gap_measure": self.measure,
            "free_run_by_motion": self.motion,
            "where": [_where(d) for d in self.where],
            "remaining": [_where(d) for d in self.remaining],
            "parameters": {name: _plain(p) for name, p in self.parameters.items()},
            "unseen": self.unseen,
            "next_experiment": self.next_experiment,
            "plan": self.plan.to_dict() if self.plan else None,
            "notes": self.notes,
            "data": self.digests,
            "held_out": self.held_out,
            "ladder": self.ladder,
            "least_squares": self.plain,
            "interrupted": self.interrupted,
        }


_KEYS = {"regressor": "driver", "delta_chi2": "gain"}
"""Keys of `result.json` that are not the attribute's name: programs read them."""


def _plain(found: object) -> dict[str, Any]:
    """Return attributes by their keys in `result.json`."""
    return {_KEYS.get(name, name): value for name, value in vars(found).items()}


def _finding(finding: Finding) -> Mapping[str, Any]:
    parts = {name: [_plain(p) for p in getattr(finding, name)]
             for name in ("rivals", "by_experiment")}  # fmt: skip
    return {**_plain(finding), **parts}


def _where(disagreement: Disagreement) -> Mapping[str, Any]:
    return {**_plain(disagreement), "regions": [_plain(r) for r in disagreement.regions]}
