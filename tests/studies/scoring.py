"""Judging answers: what counts as right, wrong, flagged, in the right place."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hil_emulator.model.effects import CATALOGUE
from tests.studies.answer import Answer
from tests.studies.generator.cases import Case, machine
from tests.studies.generator.effects import EFFECTS, OUTSIDE, SITS
from tests.studies.generator.plant import Machine

LARGEST_CLASS = 3
"""Members that a class of inseparable effects may have and still be an answer."""

TABLES = {e.name: e.stage.table for e in CATALOGUE}

PLACES = {
    "valve": "spool, flow into chamber a", "oil": "flow into chamber a",
    "cylinder": "leakage from a to b", "friction": "force on the piston",
    "load": "force on the load",
}  # fmt: skip
"""Balance in which a named effect of each table sits."""

ORDINARY: dict[str, Callable[[Machine], float]] = {
    "valve_gain": lambda m: m.kv,
    "valve_natural_frequency": lambda m: m.wv / (2.0 * math.pi),
    "valve_damping_ratio": lambda m: m.zv,
    "land_leakage": lambda m: m.clearance,
    "oil_bulk_modulus": lambda m: m.beta,
    "entrained_air": lambda m: m.air,
    "cylinder_dead_volume_a": lambda m: m.va,
    "cylinder_dead_volume_b": lambda m: m.vb,
    "viscous_friction": lambda m: m.viscous,
    "coulomb_friction": lambda m: m.coulomb,
    "load_mass": lambda m: m.mass,
    "load_viscous_friction": lambda m: m.load_viscous,
}
"""The true value of an ordinary parameter, SI, in a machine."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one case.

    Attributes:
        case: the case.
        answer: the answer.
        exact: whether all hidden effects were named and no other.
        hits: number of names of hidden effects.
        wrong: number of names of effects that are not hidden.
        hushed: number of wrong names in an answer without any flag.
        nearest: whether the nearest effect of a flagged answer is a hidden one.
        place: whether the strongest unexplained term is in the right balance.
        errors: relative errors of the values of rightly named effects.
        covered: whether the true values are inside their intervals.
        ordinary: whether the true values of ordinary parameters are inside theirs, by name.

    """

    case: Case
    answer: Answer
    exact: bool
    hits: int
    wrong: int
    nearest: bool
    place: bool
    errors: tuple[float, ...]
    covered: tuple[bool, ...]
    ordinary: Mapping[str, bool]

    @property
    def flagged(self) -> bool:
        """Whether the answer reports another law than that of the catalogue."""
        return self.answer.flagged

    @property
    def hushed(self) -> bool:
        """Whether a wrong name came without any flag."""
        return self.wrong > 0 and not self.flagged

    @property
    def known(self) -> bool:
        """Whether a foreign law was named, or flagged with the true effect nearest."""
        return self.exact or (self.flagged and self.nearest and not self.wrong)


def judge(case: Case, answer: Answer) -> Outcome:
    """Judge one answer."""
    true = {EFFECTS[k].name for k in case.effects if k not in OUTSIDE}
    hits = [bool(true & n.members) for n in answer.named]
    sizes = all(len(n.members) <= LARGEST_CLASS for n in answer.named)
    separated = all(not n.group or answer.separates for n in answer.named)
    covered_effects = set().union(*[true & n.members for n in answer.named])
    exact = bool(hits or not true) and all(hits) and len(hits) == len(true) == len(covered_effects)
    pairs = [(n, true_size(case, n.name)) for n in answer.named]
    judged = [(n, size) for n, size in pairs if not math.isnan(size)]
    return Outcome(
        case, answer, exact=exact and sizes and separated and not _only_unknown(answer, true),
        hits=sum(hits), wrong=len(hits) - sum(hits),
        nearest=bool(true & {*answer.nearest.split(" or "), *(n.name for n in answer.named)}),
        place=_placed(case, answer),
        errors=tuple(abs(n.value / size - 1.0) for n, size in judged),
        covered=tuple(n.low <= size <= n.high for n, size in judged),
        ordinary=_ordinary(case, answer),
    )  # fmt: skip


def _ordinary(case: Case, answer: Answer) -> dict[str, bool]:
    """Return whether the machine's ordinary parameters are inside their intervals, by name."""
    real, intervals = machine(case), answer.parameters
    return {name: intervals[name][0] <= true(real) <= intervals[name][1]
            for name, true in ORDINARY.items() if name in intervals}  # fmt: skip


def _only_unknown(answer: Answer, true: set[str]) -> bool:
    """Whether a healthy machine was called unhealthy, without a name."""
    return not true and bool(answer.unknown)


def true_size(case: Case, name: str) -> float:
    """Return the true value of the knob of a named effect, NaN if it was not hidden."""
    for key, size in case.effects.items():
        if key in EFFECTS and EFFECTS[key].name == name:
            return EFFECTS[key].knob(size)
    return math.nan


def _placed(case: Case, answer: Answer) -> bool:
    """Whether the strongest term, or else a flagged name, is where the hidden effect sits."""
    words = [w for k in case.effects for w in SITS.get(k, ())]
    if answer.unknown:
        place = answer.unknown[0][0]
    else:
        flagged = [n.name for n in answer.named if n.form_differs]
        place = ", ".join(
            n.replace("_", " ") if "." in n else PLACES.get(TABLES.get(n, ""), "") for n in flagged
        )
        place = place.replace("load force.", "load cell ")
    return any(word in place for word in words)
