"""Quantities with units."""

import math

import pint
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_emulator import units
from hil_emulator.units import factor, show, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("160 bar", "Pa", 1.6e7),
        ("7.5 l/min", "m^3/s", 7.5e-3 / 60),
        ("80 mm", "m", 0.08),
        ("1000 N*s/m", "N*s/m", 1000.0),
        ("1000 N·s/m", "N*s/m", 1000.0),
        ("28 µA", "A", 28e-6),
        ("0.5 %", "1", 0.005),
        (0.5, "1", 0.5),
        ("250 Hz", "Hz", 250.0),
        ("40 degC", "K", 313.15),
        ("inf A", "A", math.inf),
        ("160bar", "Pa", 1.6e7),
        ("5 1/s", "1/s", 5.0),
        ("5/s", "1/s", 5.0),
        ("46 mm²/s", "m^2/s", 46e-6),
        ("1 m^3/(s*A*Pa^0.5)", "m^3/(s*A*Pa^0.5)", 1.0),
        ("40 °C", "K", 313.15),
        ("-1e-3 m**2", "m^2", -1e-3),
    ],
)
def test_a_quantity_becomes_its_si_number(text: object, unit: str, value: float) -> None:
    """What engineers write is read as the SI number it means."""
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("7.5 mm", "m^3/s", "is a length; a flow is wanted"),
        ("160", "Pa", "is a plain number; a pressure is wanted"),
        (160, "Pa", "has no unit"),
        ("160 baz", "Pa", "cannot be read as a pressure"),
        ("", "Pa", "cannot be read as a pressure"),
        ("nan bar", "Pa", "is not a number"),
        (True, "1", "is not a quantity"),
        (None, "Pa", "is not a quantity"),
        ("__import__('os')", "Pa", "cannot be read"),
        ("9**9**8 bar", "Pa", "cannot be read"),
        ("2*80 bar", "Pa", "cannot be read"),
        ("(160) bar", "Pa", "cannot be read"),
        ("1,5 bar", "Pa", "cannot be read"),
        ("1 m^99", "m", "cannot be read"),
        pytest.param("1" * 5000 + " bar", "Pa", r'1 \.\.\." cannot be read', id="long"),
        pytest.param(10**5000, "1", "int of a size beyond all measure", id="huge"),
        ([[[[[[[[]]]]]]]], "1", "is not a quantity"),
    ],
)
def test_a_wrong_quantity_is_refused_with_what_is_wanted(
    text: object, unit: str, message: str
) -> None:
    """A wrong dimension, a missing or an unknown unit is named, never guessed."""
    with pytest.raises(ValueError, match=message):
        to_si(text, unit)


def test_a_value_is_shown_in_the_unit_engineers_use() -> None:
    """Showing and reading are inverse."""
    assert show(1.6e7, "Pa", "bar") == "160 bar"
    assert show(0.01, "1", "%") == "1 %"
    assert show(math.inf, "A", "mA") == "unlimited"
    assert to_si(show(0.0125, "m", "mm"), "m") == pytest.approx(0.0125)
    assert factor("Pa", "bar") == pytest.approx(1e5)


PIECES = (
    *(
        "9",
        "1",
        "0.5",
        "1e9",
        "-",
        "+",
        "*",
        "**",
        "/",
        "//",
        "^",
        "(",
        ")",
        " ",
        ",",
        "%",
        "e",
        "_",
    ),
    *("bar", "mm", "l", "min", "m", "s", "N", "degC", "inf", "nan", "pi", "²", "⁹", "·", "µA", "°"),
)
TEXTS = st.one_of(st.lists(st.sampled_from(PIECES), max_size=12).map("".join), st.text(max_size=90))
INDEPENDENT = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
"""Reads units for the comparison without the grammar."""


@settings(max_examples=2_000, deadline=None, database=None)
@given(TEXTS)
@example("9**9**8 bar")
@example("2 bar + 3 bar")
@example("1 (m^9)^9")
def test_no_text_is_evaluated(text: str) -> None:
    """Of 2,000 texts, most of them formulas, one that is accepted is its number times its unit."""
    try:
        value = to_si(text, "Pa")
    except ValueError:
        return
    number, unit = next(
        (text[:n], text[n:]) for n in range(len(text), 0, -1) if is_number(text[:n])
    )
    unit = INDEPENDENT.Quantity(1.0, f"1{unit}" if unit.lstrip().startswith("/") else unit)
    assert value == pytest.approx(float(number) * unit.to("Pa").magnitude, rel=1e-12)


def is_number(text: str) -> bool:
    """Tell whether Python reads a text as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def test_a_usual_unit_agrees_with_the_registry_of_units() -> None:
    """Factors in the table are those of an independent registry, to its last digits."""
    for unit, factors in units._FACTORS.items():
        for written, in_si in factors.items():
            expected = INDEPENDENT.Quantity(1.0, written).to(unit).magnitude
            assert in_si == pytest.approx(expected, rel=1e-15), written
