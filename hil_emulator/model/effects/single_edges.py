"""Laps and gains of single edges of the valve, in addition to those common to all four.

Data sheets call them P-A, A-T, P-B and B-T; s and t are the valve's ports P and T. The edges s-a
and b-t open with a positive spool position, s-b and a-t with a negative one. `overlap`, `underlap`,
`null_bias` and `gain_asymmetry` apply to all four edges or to pairs; a single edge differs by wear
or wrong grinding.
"""

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import edge_at, edge_bt, edge_sa, edge_sb

_LAND = "S1 Fig. 3.3, for one land: the four edges in sleeve and spool have independent positions"
_SLOT = "S1 eq. 3.5, a = W u_v, with a gradient W of its own: the port's width"
_SHOWS = "at reversals one chamber's pressure moves before the other's, and nulls of flow differ"
_STEEP = "one chamber's flow deviates in one direction only"
_UNLIKE = "Reynolds number and clearance of the wider slot: it is modelled as a larger opening"


def _lap(ports: str) -> Param:
    return Param("lap", "A", f"spool travel before the edge {ports} opens, over that of the others",
                 1e-4, -6e-3, 6e-3, shown="mA")  # fmt: skip


def _gain(ports: str) -> Param:
    return Param("excess", "1", f"area gradient of the edge {ports}, over that of the others",
                 0.05, -0.9, 2.0, shown="%")  # fmt: skip


@effect(edge_sa, knob=_lap("P-A"), source=_LAND, signature=_SHOWS)
def lap_sa(opening: float, lap: float) -> float:
    """u_sa = u_v - u_lap.

    The edge from supply to chamber a opens late.
    """
    return opening - lap


@effect(edge_at, knob=_lap("A-T"), source=_LAND, signature=_SHOWS)
def lap_at(opening: float, lap: float) -> float:
    """u_at = -u_v - u_lap.

    The edge from chamber a to the tank opens late.
    """
    return opening - lap


@effect(edge_sb, knob=_lap("P-B"), source=_LAND, signature=_SHOWS)
def lap_sb(opening: float, lap: float) -> float:
    """u_sb = -u_v - u_lap.

    The edge from supply to chamber b opens late.
    """
    return opening - lap


@effect(edge_bt, knob=_lap("B-T"), source=_LAND, signature=_SHOWS)
def lap_bt(opening: float, lap: float) -> float:
    """u_bt = u_v - u_lap.

    The edge from chamber b to the tank opens late.
    """
    return opening - lap


@effect(edge_sa, knob=_gain("P-A"), source=_SLOT, signature=_STEEP, not_modelled=_UNLIKE)
def gain_sa(opening: float, excess: float) -> float:
    """u_sa = u_sa (1 + g).

    The edge from supply to chamber a opens wider than the others.
    """
    return opening * (1.0 + excess)


@effect(edge_at, knob=_gain("A-T"), source=_SLOT, signature=_STEEP, not_modelled=_UNLIKE)
def gain_at(opening: float, excess: float) -> float:
    """u_at = u_at (1 + g).

    The edge from chamber a to the tank opens wider than the others.
    """
    return opening * (1.0 + excess)


@effect(edge_sb, knob=_gain("P-B"), source=_SLOT, signature=_STEEP, not_modelled=_UNLIKE)
def gain_sb(opening: float, excess: float) -> float:
    """u_sb = u_sb (1 + g).

    The edge from supply to chamber b opens wider than the others.
    """
    return opening * (1.0 + excess)


@effect(edge_bt, knob=_gain("B-T"), source=_SLOT, signature=_STEEP, not_modelled=_UNLIKE)
def gain_bt(opening: float, excess: float) -> float:
    """u_bt = u_bt (1 + g).

    The edge from chamber b to the tank opens wider than the others.
    """
    return opening * (1.0 + excess)


EFFECTS = (lap_sa, lap_at, lap_sb, lap_bt, gain_sa, gain_at, gain_sb, gain_bt)
