"""How a number of the model follows from the coordinate that a fit moves."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_emulator.identify.prediction.plant.coordinate import Coordinate, Scaling
from hil_emulator.identify.prediction.plant.parameters import ordinary
from hil_emulator.model import quantities
from hil_emulator.model.declare import Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.stages import SAMPLED
from tests.identify.rig_data import knee_model

SCALINGS: tuple[Scaling, ...] = ("linear", "logarithmic", "vanishing", "inverse")


def coordinate(scaling: Scaling, power: float = 1.5) -> Coordinate:
    """Return a coordinate about 4, from 0 to 1e6."""
    return Coordinate(
        "n", "n", "", "1", "", 0.7, 4.0, scaling, 0.0, 1e6, 1.0, None, power=power
    )  # fmt: skip


@given(scaling=st.sampled_from(SCALINGS), value=st.floats(1e-3, 1e5))
def test_a_value_and_its_coordinate_are_each_other_s_inverse(
    scaling: Scaling, value: float
) -> None:
    """In each scaling, over eight decades."""
    c = coordinate(scaling)
    assert c.value(c.at(value)) == pytest.approx(value, rel=1e-9)


def test_the_configuration_is_at_zero() -> None:
    """The same for every scaling but the inverse one, which begins at infinity."""
    assert all(coordinate(s).value(0.0) == pytest.approx(4.0) for s in SCALINGS[:3])
    assert coordinate("inverse").value(0.0) == math.inf


def test_what_may_vanish_reaches_zero_as_its_power_grows() -> None:
    """At its lower end it is 0, and near there value^power is in proportion to the distance."""
    c = coordinate("vanishing")
    low, _ = c.bounds
    assert c.value(low) == 0.0
    near = [c.value(low + d) ** c.power for d in (1e-4, 2e-4)]
    assert near[1] / near[0] == pytest.approx(2.0, rel=1e-3)


def test_a_factor_of_the_spread_is_one_standard_deviation() -> None:
    """Of the numbers that no file states, at the reference machine: one up, and one down."""
    spreads = {f"{t}_{p.name}": p for t, ps in quantities.PARAMS.items() for p in ps}
    unstated = [c for c in ordinary(knee_model()) if c.field in spreads and not c.stated]
    assert len(unstated) > 5
    for c in unstated:
        spread = spreads[c.field].spread
        assert spread is not None
        moved = math.exp(spread.size) if spread.logarithmic else spread.size
        expected = c.neutral * moved if spread.logarithmic else c.neutral + moved
        assert c.value(1.0) == pytest.approx(expected), c.name


def without_spread() -> list[str]:
    """Return the numbers that have a default and no spread."""
    shapes = [p for e in CATALOGUE for p in e.shape]
    base = [p for params in quantities.PARAMS.values() for p in params if p.default is not None]
    return [p.name for p in (*shapes, *base) if p.spread is None]


def test_every_default_states_its_spread_among_machines() -> None:
    """A number that no file states is not exact because a default stands in for it."""
    assert without_spread() == []


def test_what_a_factor_spreads_is_positive() -> None:
    """A logarithm has no negative number."""
    params: list[Param] = [p for e in CATALOGUE if e.stage not in SAMPLED for p in e.shape]
    params += [p for ps in quantities.PARAMS.values() for p in ps if p.default is not None]
    for p in params:
        if p.spread is not None and p.spread.logarithmic and p.spread.size:
            assert (p.default or p.typical) > 0.0, p.name


def test_what_a_file_states_is_open_by_its_tolerance() -> None:
    """The reference machine's mass by 2 %; its viscosity, which it does not state, twofold."""
    open_ones = {c.name: c for c in ordinary(knee_model())}
    assert open_ones["load_mass"].value(1.0) == pytest.approx(51.0)
    assert open_ones["load_mass"].stated
    assert not open_ones["oil_kinematic_viscosity"].stated
    wider = replace(knee_model().config, tolerances={"load_mass": 0.3})
    model = knee_model()
    before, model.config = model.config, wider
    try:
        mass = next(c for c in ordinary(model) if c.name == "load_mass")
    finally:
        model.config = before
    assert mass.value(1.0) == pytest.approx(65.0)
