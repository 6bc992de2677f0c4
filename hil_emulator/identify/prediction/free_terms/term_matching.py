"""Match of free terms with effects, by balance, regressor and sensor channel."""

import inspect
import math
from typing import Protocol

from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.free_terms.regressors import REGRESSORS
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.model.stages import load


class Term(Protocol):
    """A term over one regressor in one balance."""

    @property
    def balance(self) -> Balance:
        """Balance of the term."""

    @property
    def regressor(self) -> str:
        """Regressor of the term."""


def acts_in(coordinate: Coordinate, balance: Balance) -> bool:
    """Return whether the law of an effect acts in a balance or in its sensor channel."""
    if balance.channel or coordinate.channel:
        return coordinate.channel == balance.channel
    return coordinate.effect is not None and balance.name in coordinate.effect.stage.balances


def depends_on(coordinate: Coordinate, regressor: str) -> bool:
    """Return whether the law of an effect depends on the regressor of a term."""
    effect, arguments = coordinate.effect, REGRESSORS[regressor].arguments
    return effect is not None and bool(arguments & set(inspect.signature(effect.law).parameters))


def calibrates(term: Term, coordinate: Coordinate) -> bool:
    """Return whether a term is a calibration curve that contains an effect of its sensor.

    The effect must depend on the reading, and on nothing else.
    """
    effect = coordinate.effect
    if effect is None or not is_curve(term) or not acts_in(coordinate, term.balance):
        return False
    takes = set(inspect.signature(effect.law).parameters) - {"reading"}
    given = {effect.knob.name: effect.knob.typical, "span": 1.0}
    if not takes <= given.keys():
        return False
    half, full = (effect.law(x, **{n: given[n] for n in takes}) - x for x in (0.5, 1.0))
    return not math.isclose(half, full, rel_tol=1e-6)


def is_curve(term: Term) -> bool:
    """Return whether a term is the error of a sensor over its own reading."""
    return bool(term.balance.channel) and "reading" in REGRESSORS[term.regressor].arguments


def is_constant(coordinate: Coordinate) -> bool:
    """Return whether an effect adds a constant to a reading or to the load's force."""
    effect = coordinate.effect
    if effect is None or not (coordinate.channel or effect.stage == load):
        return False
    takes = set(inspect.signature(effect.law).parameters)
    given = {effect.knob.name: effect.knob.typical}
    if takes - {"reading"} != given.keys() or effect.states:
        return False
    if "reading" not in takes:
        return True
    half, full = (effect.law(reading=x, **given) - x for x in (0.5, 1.0))
    return math.isclose(half, full, rel_tol=1e-6)


def is_part(term: Term, coordinate: Coordinate) -> bool:
    """Return whether a term in the balance of an effect may be a part of its law."""
    return acts_in(coordinate, term.balance) and (
        not is_curve(term) or calibrates(term, coordinate)
    )
