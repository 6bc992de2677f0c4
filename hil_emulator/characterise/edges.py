"""The valve's edges as configured: openings, the dead band, and the loops of the spool.

A test with an open valve drives the spool beyond the dead band. A test that needs a defined spool
position first moves the current far beyond hysteresis and threshold.
"""

import math
from dataclasses import dataclass

import numpy as np

from hil_emulator.characterise.result import Series
from hil_emulator.characterise.stand import Bench

_FAR = 6.0
"""Change of current after which the spool has crossed its loop to 0.2 %, in loop widths."""

_ABOUT, _WITHIN = 3.0, 0.4
"""Range of a sweep about null in widths of the null, without and with a dead band. The dead band is
about one width wide."""

_SENSES = {"sa": 1.0, "bt": 1.0, "sb": -1.0, "at": -1.0}
"""Sign of the travel that opens each edge."""


@dataclass(frozen=True)
class Edges:
    """The edges of a bench's valve.

    Attributes:
        overlap: travel before an edge opens [A].
        underlap: opening at null [A].
        clearance: opening equivalent to the leaking lands [A].
        passage: opening with the same resistance as the passages [A].
        rated: travel of full command [A].
        laps: of single edges [A].
        gains: gains of single edges relative to the valve's gain.

    """

    overlap: float
    underlap: float
    clearance: float
    passage: float
    rated: float
    laps: dict[str, float]
    gains: dict[str, float]

    @classmethod
    def of(cls, bench: Bench) -> "Edges":
        """Return the edges of a bench's valve."""
        side = bench.value("gain_asymmetry_asymmetry")
        return cls(
            bench.value("overlap_lap"), bench.value("underlap_lap"),
            bench.value("land_leakage_clearance"), bench.value("flow_saturation_passage"),
            bench.rated_current,
            {edge: bench.value(f"lap_{edge}_lap") for edge in _SENSES},
            {edge: (1.0 + bench.value(f"gain_{edge}_excess")) * (1.0 + sense * side)
             for edge, sense in _SENSES.items()},
        )  # fmt: skip

    def opening(self, travel: float, edge: str = "sa") -> float:
        """Return the effective opening of an edge at a travel of the spool [A]."""
        past = (_SENSES[edge] * travel - self.laps[edge]) * self.gains[edge]
        open_by = past - self.overlap + self.underlap
        if open_by > 0.0:
            worth = open_by + self.clearance
        elif self.clearance:
            worth = self.clearance * math.sqrt(self.clearance / (self.clearance - 2.0 * open_by))
        else:
            return 0.0
        return worth / math.hypot(1.0, worth / self.passage)

    def in_series(self, travel: float) -> float:
        """Return the opening of two equal edges in series equivalent to the two open edges [A].

        Both edges carry the same flow, so the pressure drops are proportional to the inverse
        squares of the openings. The sign is that of the travel.
        """
        pair = ("sa", "bt") if travel > 0.0 else ("sb", "at")
        first, second = (self.opening(travel, edge) for edge in pair)
        whole = math.hypot(first, second)
        return math.copysign(math.sqrt(2.0) * first * second / whole if whole else 0.0, travel)

    def each_in_series(self, travel: Series) -> Series:
        """Return `in_series` of many travels."""
        return np.array([self.in_series(float(u)) for u in travel])

    def beyond(self, part: float) -> float:
        """Return the travel that opens an edge by a fraction of its full opening [A]."""
        return self.overlap + part * (self.rated - self.overlap)

    @property
    def null_width(self) -> float:
        """Travel that changes the opening at null by 100 % [A]; 0 if edges are tight at null.

        The pressure of a blocked port rises by (p_s - p_t) per width.
        """
        overlap = self.overlap - self.underlap
        if overlap <= 0.0:
            return self.clearance - overlap
        return self.clearance + 2.0 * overlap if self.clearance else 0.0

    @property
    def about_null(self) -> float:
        """Travel from null over which a blocked port's pressure is swept [A]; 0 for tight edges.

        With overlap the sweep stays within the dead band.
        """
        return (_WITHIN if self.overlap > self.underlap else _ABOUT) * self.null_width


def loop(bench: Bench) -> float:
    """Return the width of the spool's loop at one current [A]: hysteresis and threshold."""
    return bench.value("hysteresis_width") + 2.0 * bench.value("threshold_current")


def loop_reach(bench: Bench) -> float:
    """Return the change of the current after which the spool is on one side of its loop [A]."""
    width = loop(bench)
    transition = bench.value("hysteresis_transition") if bench.value("hysteresis_width") else 0.0
    return width + _FAR * transition
