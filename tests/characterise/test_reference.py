"""The emulated reference machine gives back what its documents say."""

import math
from collections.abc import Callable

import pytest

from hil_emulator.characterise.registry import known
from hil_emulator.characterise.result import BenchResult

Results = Callable[[str], BenchResult]

# What the documents say, written down here once more: quantity, value, relative tolerance.
DOCUMENTS = {
    "valve-flow": {
        "valve gain K_v": (6.68e-6, 1e-3),
        "flow at rated current, 70 bar": (7.5, 0.01),
    },
    "pressure-gain": {
        "pressure sensitivity K_pa": (159e5 / 28e-6, 0.02),
        "pressure sensitivity K_pb": (-159e5 / 28e-6, 0.02),
        "pressure sensitivity K_pa at 160 bar": (5.7e11, 0.02),
    },
    "leakage": {"valve leakage at null": (0.0633, 0.02)},
    "spool-response": {
        "spool bandwidth, ±25% at 210 bar": (250.0, 0.05),
        "spool bandwidth, ±100% at 210 bar": (100.0, 0.05),
    },
    "bulk-modulus": {
        # 0.1 % of air, 1300 MPa: E (1 + w)/(1 + w E/(k p)) by hand
        "effective bulk modulus at 10 bar": (1101.0, 1e-3),
        "effective bulk modulus at 100 bar": (1295.5, 1e-3),
    },
    "discharge": {"turbulent discharge coefficient, full opening, 70 bar": (0.6, 0.01)},
    "pump": {
        "efficiency of a variable pump at 100 bar": (0.99, 0.01),
        "efficiency of a variable pump at 250 bar": (0.90, 0.01),
    },
    "no-load": {
        "p_a in free extension": (30.1, 5e-3),
        "p_b in free extension": (49.3, 5e-3),
        "p_a in free retraction": (79.7, 5e-3),
        "p_b in free retraction": (130.7, 5e-3),
    },
    "friction": {
        "viscous coefficient B": (1000.0, 0.03),
        "Coulomb friction F_c0": (100.0, 0.03),
    },
    "friction-steady": {
        "viscous coefficient B": (1000.0, 0.03),
        "Coulomb friction F_c0": (100.0, 0.03),
    },
    "force-zeros": {
        "zero of the load force f, S1": (-10.0, 0.01),
        "zero of the hydraulic force f_h, S1": (-30.0, 0.01),
    },
    "force-poles": {"resonance at 40 mm": (60.5, 0.01)},
    "natural-frequency": {
        # 201.06 mm², 0.61, 80 mm, 3 ml each, 50 kg, 1300 MPa: 7.233e6 N/m by hand; air takes 0.3 %
        "natural frequency at 40 mm": (60.53, 5e-3),
        "damping ratio at 40 mm": (1500.0 / (2.0 * math.sqrt(7.233e6 * 50.0)), 0.01),
    },
    "sensors": {"noise of the load cell, three standard deviations": (50.0, 0.05)},
}


@pytest.mark.parametrize(
    ("test", "quantity", "value", "tolerance"),
    [(test, q, *numbers) for test, rows in DOCUMENTS.items() for q, numbers in rows.items()],
)
def test_the_document_s_number_comes_back(
    results: Results, test: str, quantity: str, value: float, tolerance: float
) -> None:
    """A procedure of the documents, performed on the emulator, finds the documents' number."""
    found = {c.quantity: c.measured for c in results(test).comparisons}
    assert found[quantity] == pytest.approx(value, rel=tolerance)


@pytest.mark.parametrize("name", [test.name for test in known()])
def test_every_comparison_of_the_reference_machine_agrees(results: Results, name: str) -> None:
    """No row of the summary says "differs"."""
    comparisons = results(name).comparisons
    assert comparisons
    assert [c.quantity for c in comparisons if not c.agrees] == []
