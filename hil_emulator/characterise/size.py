"""Size and speed of a machine, from which amplitudes and times of the tests follow.

A scale of 1 is the documents' machine, HyQ's knee.
"""

import math

from hil_emulator.characterise.stand import Bench
from hil_emulator.model.resonance import FIELDS, on_oil

REFERENCE_RESONANCE = 60.5
"""Natural frequency of HyQ's knee on its oil at mid-stroke [Hz]: 50 kg on two chambers of 3 ml."""

_DOCUMENTS = {"cylinder_piston_area": 2.0106e-4, "cylinder_stroke": 0.08, "valve_gain": 6.68e-6}
_LIKENESS = 0.05
"""Largest relative deviation of piston, stroke and valve from the documents' machine for which the
documents' figures apply (assumed)."""

_SHARE = 0.4
"""Largest speed of a test, part of the no-load speed (assumed)."""


def of_documents(bench: Bench) -> bool:
    """Return whether a machine is the documents' machine."""
    return all(abs(bench.value(n) / v - 1.0) <= _LIKENESS for n, v in _DOCUMENTS.items())


def fastest(bench: Bench) -> float:
    """Return the largest speed of a test [m/s]."""
    alpha, drop = bench.value("cylinder_area_ratio"), bench.value("supply_pressure")
    flow = bench.value("valve_gain") * bench.rated_current * math.sqrt(drop / (1.0 + alpha**3))
    return _SHARE * flow / bench.value("cylinder_piston_area")


def resonance(bench: Bench) -> float:
    """Return the natural frequency of the mass on its oil at mid-stroke [Hz]."""
    return on_oil({name: bench.value(name) for name in FIELDS})


def quickness(bench: Bench) -> float:
    """Return the machine's natural frequency over that of HyQ's knee, to two digits."""
    return float(f"{resonance(bench) / REFERENCE_RESONANCE:.2g}")
