"""Quantities with units."""

import math

import pytest

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
