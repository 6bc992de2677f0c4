"""Which catalogued effect an unexplained term is nearest to: same balance, same regressor."""

import inspect
from collections.abc import Sequence

from hil_emulator.identify.prediction import balances
from hil_emulator.identify.prediction.balances import Balance
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.selection.discrepancy_term import DiscrepancyTerm
from hil_emulator.identify.selection.scan import Score

STAGES = {
    balances.SPOOL.name: "set_point command pilot spool_force spool travel metering",
    balances.FLOW_A.name: "metering discharge tank outward_leakage oil vapour",
    balances.FLOW_B.name: "metering discharge tank outward_leakage oil vapour",
    balances.LEAKAGE.name: "cross_leakage",
    balances.PISTON.name: "friction dry_friction friction_scale stop inertia",
    balances.LOAD.name: "load coupling play",
    balances.RETURN.name: "tank",
    balances.SUPPLY.name: "source pump_loss capacity supply",
}
"""Stages of the model that act in each balance."""

TAKES = {
    "valve current": "set_point current opening travel",
    "rate of the current": "set_point current deviation spool_speed",
    "spool position": "spool_position travel opening",
    "pressure a": "pressure", "pressure b": "pressure",
    "pressure difference": "pressure_a", "position times pressure difference": "pressure_a",
    "pressure difference with the sign of velocity": "pressure_a",
    "pressure sum with the sign of velocity": "pressure_a",
    "velocity": "velocity", "position": "position",
    "position with the sign of velocity": "position", "supply flow": "flow",
    "return flow": "flow",
}  # fmt: skip
"""Arguments of a law by which it depends on a regressor."""


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
    stages = STAGES.get(balance.name, "").split()
    return coordinate.effect is not None and coordinate.effect.stage.name in stages


def depends_on(coordinate: Coordinate, regressor: str) -> bool:
    """Tell whether the law of an effect depends on what drives a term."""
    effect, takes = coordinate.effect, set(TAKES.get(regressor, "").split())
    return effect is not None and bool(takes & set(inspect.signature(effect.law).parameters))
