"""A few blind cases of the independent plant; the whole is `python -m tests.identify.study`."""

import pytest

from tests.identify.generator.cases import MEDIUM, Machine
from tests.identify.study import examine, wilson


def test_wilson_interval_of_the_text_book() -> None:
    """Nine of ten: 0.596 to 0.982 (Wilson 1927)."""
    low, high = wilson(9, 10)
    assert low == pytest.approx(0.596, abs=1e-3)
    assert high == pytest.approx(0.982, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["internal_leakage", "stribeck", "pressure_a.offset"])
def test_an_effect_of_a_foreign_simulator_is_named(name: str) -> None:
    """Other equations, integrator, friction and stops: the name is still right."""
    outcome = examine(Machine({name: MEDIUM[name]}, False, seed=1234))
    assert outcome.right, outcome.names


@pytest.mark.slow
def test_a_healthy_foreign_simulator_gets_no_name() -> None:
    """Nothing hidden, everything dirty: no name."""
    outcome = examine(Machine({}, False, seed=1234))
    assert not outcome.names
