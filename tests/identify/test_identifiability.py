"""Unstated parameters are fitted if the data determine them, products as one coordinate."""

import pytest

from hil_emulator.identify.estimation.identifiability import identifiable
from hil_emulator.identify.experiment_design import practice
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import ordinary
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, INSTRUMENTS, knee, knee_model, recorded

EDGE = {
    "valve_critical_reynolds_number", "valve_slot_per_ampere", "oil_kinematic_viscosity",
    "oil_density",
}  # fmt: skip
"""Parameters of the opening at which an edge turns turbulent: Re_c nu sqrt(rho/2)/(2 s C_d)."""


@pytest.fixture(scope="module")
def free() -> list[Coordinate]:
    """Return the ordinary parameters that the reference machine's data determine."""
    logs = [recorded({}, kind, 1, 1.0) for kind in ("multisine", "steps")]
    return identifiable(Observer(knee_model(), INSTRUMENTS), logs, ordinary(knee_model()))


def test_one_coordinate_represents_a_product(free: list[Coordinate]) -> None:
    """Four parameters enter the edge flow as a product; its prior is wider than each of theirs."""
    (edge,) = [c for c in free if c.field in EDGE]
    assert {edge.field, *edge.also} == EDGE
    assert edge.prior > 1.0


def test_a_weak_factor_of_a_product_is_not_fitted_alone() -> None:
    """The density changes these readings by so little that noise of differences shows as well."""
    model = knee_model()
    logs = practice.campaign(practice.ground(model, (), 12), practice.TRAINING, 2.0)
    free = identifiable(Observer(model, INSTRUMENTS), logs, ordinary(model))
    assert "oil_density" not in [c.name for c in free]


def test_parameters_without_influence_are_not_fitted(free: list[Coordinate]) -> None:
    """The knee has no pump and no holding valves, and does not reach a stop."""
    names = {c.name for c in free}
    assert names.isdisjoint({"supply_volume", "lines_block_volume", "end_stops"})
    assert {"valve_gain", "oil_bulk_modulus", "coulomb_friction"} <= names


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [
        {"valve_slot_per_ampere": 0.05},
        {"valve_critical_reynolds_number": 0.0},
        {"oil_kinematic_viscosity": 90e-6},
        {"friction_transition_velocity": 5e-3},
        {"friction_presliding_distance": 4e-6},
    ],
    ids=lambda n: next(iter(n)),
)
def test_a_healthy_machine_with_another_default_is_healthy(number: dict[str, float]) -> None:
    """A different value of an unstated parameter is not a missing effect."""
    learn = [recorded(number, kind, i) for i, kind in enumerate(("multisine", "steps"))]
    check = [recorded(number, "triangles", 9)]
    result = identify(knee(), learn, check, cache=CACHE)
    assert not result.effects
    assert not result.unknown
