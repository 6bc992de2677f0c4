"""The emulated reference machine reproduces the figures of its documents."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from hil_emulator.characterise.figure import new_figure
from hil_emulator.characterise.procedure import Procedure
from hil_emulator.characterise.procedures import bulk_modulus
from hil_emulator.characterise.registry import bench_tests
from hil_emulator.characterise.result import Agreement, BenchResult
from hil_emulator.characterise.stand import Bench

Results = Callable[[str], BenchResult]

SLOT, WIDTH = 28e-6 * 0.025, 2.295e-6 / 0.25e-3
"""Slot that 28 uA are worth, and its width [m]: of 2.295 mm² at 0.25 mm, the area of K_v."""
CREEPING = 2.0 * math.pi * SLOT**2 * WIDTH * 79.5e5 / (32.0 * 46e-6 * 850.0) * 6e4
"""What creeps through two such slits at half the supply pressure [l/min]."""

# Figures of the documents, stated independently: quantity, value, relative tolerance.
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
    # 28 uA of S1's sensitivity are a slit of 0.7 um by 9.18 mm, through which oil creeps:
    # twice pi x² w (dp/2)/(32 mu); past three of them one seventh of it, at the whole drop
    "leakage": {
        "valve leakage at null": (CREEPING, 0.02),
        "valve leakage 3 u_c from null": (CREEPING * 2.0 / 7.0, 0.02),
    },
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
        "efficiency of a variable pump at 100 bar": (0.99, 1e-3),
        "efficiency of a variable pump at 250 bar": (0.90, 1e-3),
    },
    "pump-torque": {
        "overall efficiency at 160 bar": (0.90, 1e-3),
        "torque per pressure over displacement": (1.045, 1e-3),
        "torque of the drag over displacement": (5.22, 1e-3),
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
    "lap": {"flow gain at null over that beyond the lap, underlap": (2.0, 0.01)},
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
    measured = {c.quantity: c.measured for c in results(test).comparisons}
    assert measured[quantity] == pytest.approx(value, rel=tolerance)


OUTRIGHT = {
    "pressure-gain": {"pressure sensitivity K_pa at 160 bar": 5.7e11},
    "spool-response": {
        "spool bandwidth, ±25% at 210 bar": 250.0,
        "spool bandwidth, ±100% at 210 bar": 100.0,
    },
    "force-zeros": {
        "zero of the load force f, S1": -10.0,
        "zero of the hydraulic force f_h, S1": -30.0,
    },
    "pump": {
        "efficiency of a variable pump at 100 bar": 0.99,
        "efficiency of a variable pump at 250 bar": 0.90,
    },
    "pump-torque": {"overall efficiency at 160 bar": 0.90},
}
"""Every number of S1 that is no parameter of the reference machine."""


@pytest.fixture(scope="module", params=bench_tests(), ids=lambda test: test.name)
def performed(request: pytest.FixtureRequest, results: Results) -> tuple[Procedure, BenchResult]:
    """Return a procedure and what it measured on the reference machine."""
    return request.param, results(request.param.name)


def test_every_comparison_of_the_reference_machine_agrees(
    performed: tuple[Procedure, BenchResult],
) -> None:
    """No row of the summary has "differs"."""
    comparisons = performed[1].comparisons
    assert comparisons
    assert [c.quantity for c in comparisons if not c.agrees] == []


def test_only_what_stands_in_a_document_counts_as_its_figure(
    performed: tuple[Procedure, BenchResult],
) -> None:
    """The group holds the documents' numbers, all of them, and nothing that is configured."""
    test, result = performed
    claimed = [c for c in result.comparisons if c.kind is Agreement.DOCUMENT]
    assert {c.quantity: c.expected for c in claimed} == OUTRIGHT.get(test.name, {})


def test_a_picture_names_each_figure_that_it_repeats(
    performed: tuple[Procedure, BenchResult],
) -> None:
    """The curves named in a caption are in the picture, under the document's name."""
    (test, result), picture = performed, new_figure()
    test.draw(result, picture)
    legends = [axes.get_legend() for axes in picture.axes]
    texts = [text.get_text() for legend in legends if legend for text in legend.get_texts()]
    texts += [axes.get_title("left") for axes in picture.axes]
    for figure in result.figures:
        assert any(figure.name in text for text in texts)


def test_a_picture_of_another_machine_repeats_no_figure(
    performed: tuple[Procedure, BenchResult],
) -> None:
    """Without figures of its own machine a picture shows nothing of the documents."""
    (test, result), picture = performed, new_figure()
    test.draw(replace(result, figures=()), picture)
    legends = [axes.get_legend() for axes in picture.axes]
    texts = [text.get_text() for legend in legends if legend for text in legend.get_texts()]
    texts += [axes.get_title("left") for axes in picture.axes]
    for figure in result.figures:
        assert not any(figure.name in text for text in texts)


def test_a_number_that_is_a_parameter_is_only_found_again(
    results: Results, bench: Callable[..., Bench]
) -> None:
    """The reference value depends on the parameter, so the agreement proves little."""
    other = bulk_modulus.run(bench(entrained_air_fraction=0.002))
    for old, new in zip(results("bulk-modulus").comparisons, other.comparisons, strict=True):
        assert new.expected != old.expected
        assert new.kind is Agreement.CONFIGURED
