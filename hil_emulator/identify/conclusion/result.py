"""Result of an identification."""

from dataclasses import dataclass, field, is_dataclass
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
    "wrong_value",
    "cannot_examine",
    "cannot_tell",
    "agrees",
    "disagrees",
]

VERDICTS: dict[Verdict, str] = {
    "missing_effects": "the configuration lacks the effects that are named",
    "nothing_missing": "the model agrees with the data; no effect is missing",
    "unknown_effect": "something is missing that no effect of the catalogue explains",
    "wrong_value": "no effect is missing, and a value is another one than configured",
    "cannot_examine": "the data cannot be examined; the reason states why",
    "cannot_tell": "the data do not decide; the reason states why",
    "agrees": "of `gap`, which does not search: no balance disagrees",
    "disagrees": "of `gap`, which does not search: a balance disagrees",
}
"""Meaning of each verdict."""


@dataclass
class Result:
    """The outcome.

    Attributes:
        verdict: the outcome.
        reason: the verdict in a sentence.
        effects: the missing effects, in the order in which they were accepted.
        unknown: significant terms that no effect explains.
        nearest: the effect that explains a part of the unknown term by another law, or two that
            explain as much ("fixed_pump or variable_pump"); "" without any.
        implausible: parameters whose estimates are implausible for such a machine, in words:
            another effect is missing as well, or was named in place of one of them.
        gap: root mean square error by channel and part of the data (`training`, `validation`):
            `before`, `after`, `floor` and, if asked for, `least_squares` one step ahead; with the
            prefix `free_` in free runs of 500 ms; with the suffix `_rms` in the channel's SI unit,
            with `_percent` in percent of the channel's standard deviation, else in the unit of
            `gap_measure`.
        motion: root mean square error of the free run by channel and region of motion, `before`,
            `after` and `floor`, on validation data if there are any, in units of the noise; with
            the suffix `_rms` in the channel's SI unit.
        where: balances in which the configured model disagrees, with regions.
        remaining: balances in which the final model disagrees, with regions.
        maps: missing terms of the worst balances over their regressors, before and after.
        measure: unit of the gap.
        parameters: parameters of the configuration that were estimated together with the effects,
            by name.
        unseen: effects that these data cannot show.
        next_experiment: what to record next, in words; "" if nothing is needed.
        plan: the next experiment in numbers; null if nothing is needed or could be forecast.
        notes: remarks on the data.
        digests: by experiment, the first 16 hexadecimal digits of the SHA-256 digest of its file;
            "" if there is no file.
        held_out: experiments that were not used for the fit.
        ladder: for each accepted effect `effect`, the effect `beside` which it was examined or
            null, and its gain in chi-square on the `training` and `validation` data.
        search: the search itself.
        traces: by experiment and channel, see `gap.traces`.
        repeats: repeatability of the final residual; None if the noise of the channel is known.
        plain: estimate of every parameter by ordinary least squares [SI]; empty unless asked for.
        interrupted: whether the user ended the search before it was complete.
        added: the strongest unexplained term as an effect file; None without a term, or if the
            model has no place for it.
        final_at: coordinates of the final model, ordinary parameters first.

    """

    verdict: Verdict
    reason: str
    effects: list[Finding] = field(default_factory=list)
    unknown: list[Unexplained] = field(default_factory=list)
    nearest: str = ""
    implausible: list[str] = field(default_factory=list)
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
        """Return the content of `result.json`."""
        return {KEYS.get(n, n): _as_json(v) for n, v in vars(self).items() if n not in INTERNAL}


INTERNAL = frozenset({"search", "traces", "maps", "repeats", "added", "final_at"})
"""Attributes of a result that `result.json` does not hold."""

KEYS = {
    "regressor": "driver",
    "delta_chi2": "gain",
    "measure": "gap_measure",
    "motion": "free_run_by_motion",
    "digests": "data",
    "implausible": "hardly_believed",
    "plain": "least_squares",
}
"""Keys of `result.json` that differ from the attribute's name: programs read them."""


def _as_json(value: Any) -> Any:
    """Return a value of a result as JSON holds it."""
    if is_dataclass(value):
        return {KEYS.get(name, name): _as_json(inner) for name, inner in vars(value).items()}
    if isinstance(value, dict):
        return {key: _as_json(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_as_json(inner) for inner in value]
    return value
