"""Which catalogued effect an unexplained term is nearest to: same balance, same regressor."""

import inspect
from collections.abc import Sequence

from hil_emulator.identify.prediction.balances import Balance
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.prediction.regressors import REGRESSORS
from hil_emulator.identify.selection.discrepancy_term import DiscrepancyTerm
from hil_emulator.identify.selection.scan import Score


def nearest(term: DiscrepancyTerm, scores: Sequence[Score]) -> str:
    """Return the candidate of the term's balance that resembles it, or "".

    One whose law depends on the term's regressor comes before any other.

    Args:
        term: the unexplained term.
        scores: of the candidates, best first.

    """
    there = [s for s in scores if s.statistic > 0.0 and acts_in(s.coordinate, term.balance)]
    there.sort(key=lambda s: not depends_on(s.coordinate, term.regressor))
    return there[0].coordinate.name if there else ""


def acts_in(coordinate: Coordinate, balance: Balance) -> bool:
    """Tell whether the law of an effect acts in a balance, or in the channel that it is about."""
    if balance.channel or coordinate.channel:
        return coordinate.channel == balance.channel
    return coordinate.effect is not None and balance.name in coordinate.effect.stage.balances


def depends_on(coordinate: Coordinate, regressor: str) -> bool:
    """Tell whether the law of an effect depends on the regressor of a term."""
    effect, arguments = coordinate.effect, REGRESSORS[regressor].arguments
    return effect is not None and bool(arguments & set(inspect.signature(effect.law).parameters))
