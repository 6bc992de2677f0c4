"""The rules by which a search decides: what each protects from, and how it is left out.

A rule is left out by another value of a constant, or another function, in the module that uses it:
the product knows nothing of this table, and `test_rules.py` sees to it that the table knows every
constant of the product.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from hil_emulator.identify.selection.refits import CandidateRefits

SELECTION = "hil_emulator.identify.selection"
ALL = 1e300
"""Larger than anything that is compared with it, and finite: products with nothing stay nothing."""


@dataclass(frozen=True)
class Rule:
    """One decision of a search.

    Attributes:
        protects: from what goes wrong without it.
        without: new values that leave it out, by `module.name` or `module.Class.name`.
        constants: further constants of it, each as `module.NAME`.

    """

    protects: str
    without: Mapping[str, Any]
    constants: tuple[str, ...] = ()


def _nothing(*_: object) -> None:
    """Stand in for what changes a search."""


def _likely(_: object, scores: object, likely: Any, before: object) -> Any:
    return likely


def _as_it_is(_: CandidateRefits, fit: Any) -> Any:
    return fit


def _nowhere(experiments: Any) -> Any:
    return [np.full(e.samples, -1) for e in experiments]


def _all_of_them(*asked: Any) -> list[str]:
    return [coordinates[-1].name for coordinates, _ in asked[-1]]


@dataclass(frozen=True)
class Always:
    """A function with a constant result.

    Attributes:
        answer: the result of a rule that does not object.

    """

    answer: Any

    def __call__(self, *_: object) -> Any:
        """Say it."""
        return self.answer

    def __get__(self, owner: object, kind: type | None = None) -> "Always":
        """Return itself as a method, too."""
        return self


RULES: dict[str, Rule] = {
    # whether a candidate explains enough
    "chance": Rule("a name for chance, or for correlated noise",
                   {"levels.FALSE_ALARM": 1.0}),
    "held-out gain": Rule("a law that bends to its data",
                          {"evidence.LEAST_HELD_OUT": -ALL}),
    "left by a law": Rule("naming what an inexact law leaves",
                                     {"law_form.LAW_TOLERANCE": -ALL}),
    "outshone": Rule("a catalogue's name for an unknown effect",
                     {"law_form.free_term_explains_more": Always(False)}),
    "less noise": Rule("noise that is the gap itself", {"search.reweigh_by_best": Always(None)}),
    # which candidate comes first
    "held-out order": Rule("the law that bends best", {"evidence.NEARLY_ALL": 1.0}),
    "modesty": Rule("the law with more assumed shapes", {"evidence.SMALL_PART": -ALL}),
    "pairs": Rule("a third effect for two that hide each other",
                  {"search.PairSearch.first_of_pair": Always(None)}),
    "confirmation": Rule("a linearisation that leads nowhere",
                         {"starts.NonlinearCheck._holds": Always(True)}),
    "kin": Rule("missing one of two that do the same",
                {"starts.NonlinearCheck._same_stage": Always([])}),
    "takeover": Rule("parameters that hide an effect",
                     {"starts.NuisanceRestart.starts": Always([])}),
    "stood in for": Rule("parameters that stand in for an effect which explains nothing then",
                         {"starts.NonlinearCheck.masked_by_nuisance": _likely}),
    "pushed": Rule("a refit that stopped at a kink",
                   {"refits.CandidateRefits._pushed": _as_it_is}),
    "same place": Rule("a name for friction that ripples along the stroke",
                       {"estimation.map_fit.places_of": _nowhere}),
    # what belongs to the law of an effect in the model
    "overshadowed": Rule("a further name for what a law leaves",
                         {"law_form.own_law_explains_more": Always(False)}),
    "one sensor": Rule("two errors of one sensor for one",
                       {"law_form._of_same_sensor": Always(False)}),
    "tried elsewhere": Rule("silence about what acts elsewhere than a law that does not fit",
                            {"search.untried_independent": Always([])}),
    "stands beside": Rule("silence about a further effect next to a foreign law",
                          {"law_form.independent_of_named_laws": lambda *_: False}),
    "apart": Rule("silence about a sensor's small error, apart from a law that does not fit",
                  {"law_form._independent": Always(False)}),
    # whether the law of what was named fits, and what remains
    "other law": Rule("a foreign law passed off as the catalogue's",
                      {"discrepancies.LAW_TOLERANCE": ALL}, ("discrepancies.LAW_ERROR_SIZES",)),
    "sizes apart": Rule("a law of another form that no free term shows",
                        {"search.heterogeneous_estimates": Always({})}),
    "displaced": Rule("friction of another form passed off as what takes the place of dry friction",
                      {"search.displacing": Always({})}),
    "left in place": Rule("a foreign law passed off as the catalogue's, or a value as certain",
                          {"search.rejected_in_place": Always({})}),
    "between": Rule("one of two laws for what lies between", {"search.mixed_laws": Always({})}),
    "noticeable": Rule("a word on ripple that every machine has",
                       {"progress.NOTICEABLE": 0.0, "discrepancies.NOTICEABLE": 0.0},
                       ("discrepancies.VARIANCE_SHARES", "discrepancies.SMOOTH")),
    # what is taken back
    "led to better": Rule("a name for what ordinary parameters explain elsewhere",
                          {"search.Searcher._better_base": Always(False)}),
    "faint": Rule("a name for ripple", {"search.weak_effects": Always([])}),
    "re-examined": Rule("an early name that a later one explains",
                        {"search.drop_superfluous": _nothing}),
    # effects that data do not separate
    "alike": Rule("one name where data show a class", {"search.rivals_of": Always(([], None))}),
    "alike in the end": Rule("a class that the whole model separates",
                             {"conclusion.conclude.confirmed_rivals": _all_of_them}),
    "near rivals": Rule("the wrong one of two laws that both miss",
                        {"conclusion.conclude.near_rivals": Always({})}),
}  # fmt: skip
"""Every rule by its name, in the order in which a search meets them."""

EFFORT = (
    "refits.ITERATIONS_AT_ONCE", "refits.MOST_CONTINUATIONS",
    "refits.WORTHWHILE_PART", "refits.PROMISING", "refits.LITTLE_PART",
    "starts.LEAST_EXPECTED_GAIN", "starts.SECANTS", "starts.MOST_SIZE_SEARCHES",
    "scan.NO_EFFECT", "discrepancies.MOST_DISCREPANCIES",
    "progress.MOST_SHOWN", "rivals.RIVAL_ITERATIONS", "mixed_law.SHARED_ITERATIONS",
    "scan.MOST_PAIRS", "scan.ROWS_AT_ONCE", "scan.LEAST_COARSE_PART", "refits.STEP_FRACTIONS",
    "refits.PARTNER_ITERATIONS",
    "rivals.MOST_RIVALS_TRIED", "rivals.PASSES", "rivals.RIVAL_PASS_ITERATIONS",
    "refits.NOISE_PASSES", "refits.NOISE_ITERATIONS",
    "search.REFITTED", "search.RETURN_ITERATIONS", "search.BETTER_BASES", "search.MOST_EFFECTS",
    "search.REWEIGHTED_ITERATIONS", "search.KEPT_TERMS",
    "starts.SLOW_FACTOR", "starts.RESTART_ITERATIONS", "starts.SAME_EFFECT", "starts.TRIED_SIZES",
    "mixed_law.RIVAL_SHARE", "rivals.MOST_REPORTED", "law_form.MOST_NEAREST",
    "law_form.LEAST_REMAINING", "law_form.MOST_UNTRIED",
)  # fmt: skip
"""Constants that decide nothing: number and starting points of computations, resolution, and amount
of kept and reported numbers."""

LEVELS = ("levels.GREATER_PART", "levels.NEARLY_ALL", "levels.SMALL_PART",
          "levels.LAW_TOLERANCE", "levels.NOTICEABLE")  # fmt: skip
"""Constants that several rules share; of a rule, see in which module it asks for them."""

DERIVED = ("levels.SIGNIFICANCE", "levels.NORMAL_95", "levels.DISTINGUISHABLE",
           "evidence.LEAST_HELD_OUT")  # fmt: skip
"""Quantiles of known distributions, which were not chosen by their results."""


@contextmanager
def changed(values: Mapping[str, Any]) -> Iterator[None]:
    """Put other values in the place of names, and back again at the end."""
    before = []
    try:
        for name, value in values.items():
            owner, attribute = holder(name)
            before.append((owner, attribute, vars(owner)[attribute]))
            setattr(owner, attribute, value)
        yield
    finally:
        for owner, attribute, value in reversed(before):
            setattr(owner, attribute, value)


def holder(name: str) -> tuple[Any, str]:
    """Return the module or the class that holds a name of the table, and its last part."""
    *path, attribute = name.split(".")
    of_class = [path.pop()] if path[-1][0].isupper() else []
    room = (
        SELECTION
        if path[0] not in ("conclusion", "estimation", "session")
        else "hil_emulator.identify"
    )
    owner: Any = import_module(".".join([room, *path]))
    return (getattr(owner, of_class[0]) if of_class else owner), attribute
