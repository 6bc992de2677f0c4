"""Which rules decide something in a search: what is asked is answered without each of them, too."""

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.selection.progress import Round, Search
from tests.studies.rules.rules import RULES, changed, holder

_PASSED = ("evidence.Evidence.passed",)
_RANKED = ("refits.ranked", "law_form.ranked")

ASKED = {
    "evidence.LEAST_HELD_OUT": _PASSED,
    "evidence.NEARLY_ALL": _RANKED,
    "evidence.SMALL_PART": _RANKED,
    "law_form.LAW_TOLERANCE": ("search.judge",),
    "discrepancies.LAW_TOLERANCE": ("discrepancies.Discrepancies.other_laws",),
    "progress.NOTICEABLE": ("progress.Round.noticeable",),
    "discrepancies.NOTICEABLE": (
        "discrepancies.Discrepancies.unknown",
        "discrepancies.Discrepancies.other_laws",
    ),
}
"""Functions and properties whose answers are all that a constant decides, by its name."""


def watched(rule: str) -> Sequence[str]:
    """Return the functions that show whether a rule decides something; empty if unknown."""
    places = [ASKED.get(name, ()) if name.rpartition(".")[2].isupper() else (name,)
              for name in RULES[rule].without]  # fmt: skip
    return [name for place in places for name in place] if all(places) else []


@contextmanager
def deciding(rules: Sequence[str]) -> Iterator[set[str]]:
    """Yield the rules that decide something in the block, with all that cannot be watched.

    A rule decides nothing if all calls have the same results without it. The steps that the fitter
    has learnt for its difference quotients may then differ.
    """
    decided = {rule for rule in rules if not watched(rule)}
    watching = _Watching(decided)
    points = {name for rule in rules for name in watched(rule)}
    wrapped = {name: watching.wrapped(name, [r for r in rules if name in watched(r)])
               for name in points}  # fmt: skip
    with changed(wrapped):
        yield decided


class _Watching:
    """Wraps functions, and repeats each call without rules.

    Args:
        deciding_rules: receives the rules that make a difference.

    """

    def __init__(self, deciding_rules: set[str]) -> None:
        self._deciding = deciding_rules
        self._repeating = False

    def wrapped(self, name: str, rules: Sequence[str]) -> Any:
        """Return a function or property that watches some rules."""
        owner, attribute = holder(name)
        original = vars(owner)[attribute]
        asked = original.fget if isinstance(original, property) else original

        def watching(*args: Any) -> Any:
            others = {} if self._repeating else {
                rule: self._without(rule, name, asked, args)
                for rule in rules if rule not in self._deciding
            }  # fmt: skip
            result = asked(*args)
            self._deciding |= {
                rule for rule, other in others.items() if not same(other, (result, args))
            }
            return result

        return property(watching) if isinstance(original, property) else watching

    def _without(
        self, rule: str, name: str, asked: Callable[..., Any], args: Sequence[Any]
    ) -> tuple[Any, tuple[Any, ...]]:
        """Return the result without a rule, and the copied arguments after the call."""
        aside = tuple(map(_aside, args))
        without = RULES[rule].without
        fitters = [a for a in (*args, *map(_fitter, args)) if isinstance(a, Fitter)]
        self._repeating = True
        with _untouched(fitters), changed(without):
            other = without.get(name, asked)
            result = other(*aside) if callable(other) else other
        self._repeating = False
        return result, aside


def _aside(value: Any) -> Any:
    """Return a copy of a round or search, into which decisions are written; else the value."""
    if not isinstance(value, (Round, Search)):
        return value
    return replace(value, **{name: copy.copy(part) for name, part in vars(value).items()
                             if isinstance(part, (list, dict))})  # fmt: skip


def _fitter(value: Any) -> Any:
    return getattr(value, "_fitter", None)


@contextmanager
def _untouched(fitters: Sequence[Fitter]) -> Iterator[None]:
    """Leave fitters as they were: their gains, and the steps that they have learnt."""
    before = [(f, f.batch, copy.deepcopy(f._steps)) for f in fitters]
    try:
        yield
    finally:
        for fitter, batch, steps in before:
            fitter.batch, fitter._steps = batch, steps


def same(one: Any, other: Any) -> bool:
    """Tell whether two answers are the same to the bit."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[k], other[k]) for k in one)
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return bool(one == other)
