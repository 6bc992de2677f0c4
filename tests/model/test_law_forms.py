"""Published forms of the base laws that differ from the model's."""

from types import SimpleNamespace

import numpy as np
import pytest

from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.law_forms import (
    FORMS,
    RESISTANCES_IN_SERIES,
    USUAL,
    ModelRun,
    laminar_transition,
    since_reversal,
)
from hil_emulator.model.servo_valve import transition
from hil_emulator.model.stages import FLOW_A, FLOW_B

PLANT = {
    "valve_gain": 6.7e-6, "valve_critical_reynolds_number": 14.7, "valve_slot_per_ampere": 0.025,
    "oil_kinematic_viscosity": 46e-6, "oil_density": 850.0, "valve_natural_frequency": 250.0,
}  # fmt: skip


def flows(opening: np.ndarray, drop: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the model's flow, and that of the laminar and the turbulent drop in series.

    The latter solves dp = R_l q + q²/(K u)², with R_l so that both drops are equal where the model
    turns turbulent.
    """
    gain, turns = PLANT["valve_gain"], transition(SimpleNamespace(**PLANT), 1.0)
    turbulent = gain * opening * np.sqrt(drop)
    laminar = gain * opening**2 * drop / turns
    model = (turbulent**-4.0 + laminar**-4.0) ** -0.25
    a, b = 1.0 / turbulent**2, 1.0 / laminar
    return model, (-b + np.sqrt(b * b + 4.0 * a)) / (2.0 * a)


@pytest.mark.parametrize(("name", "balance"), [("flow_a", FLOW_A), ("flow_b", FLOW_B)])
def test_a_term_leads_to_resistances_in_series(name: str, balance: str) -> None:
    """The first shape, at its full share, turns the model's flow into that of drops in series.

    Their quadratic equation is solved here, for flows of either sense.
    """
    openings = np.geomspace(1e-6, 1e-2, 40)
    model, series = flows(openings, 70e5)
    for sense in (1.0, -1.0):
        signals = {"flow_a": sense * model, "flow_b": sense * model}
        change = laminar_transition(ModelRun(signals, PLANT, PLANT))[balance][:, 0]
        reached = signals[name] + change / RESISTANCES_IN_SERIES
        np.testing.assert_allclose(reached, sense * series, rtol=1e-9)


def test_forms_agree_far_from_where_they_bend() -> None:
    """At the full opening, forms of the edge differ by less than 3 %; without flow, not at all."""
    model, _ = flows(np.array([1e-2]), 100e5)
    signals = {"flow_a": np.array([0.0, *model]), "flow_b": np.array([0.0, *model])}
    terms = laminar_transition(ModelRun(signals, PLANT, PLANT))[FLOW_A]
    np.testing.assert_array_equal(terms[0], 0.0)
    assert np.all(np.abs(terms[1]) < 0.03 * model[0])


def test_the_way_since_a_reversal_restarts_with_each() -> None:
    """It grows with the way from the last turning point, and is zero there."""
    time = np.linspace(0.0, 1.0, 401)
    position, velocity = -np.cos(2.0 * np.pi * time), np.sin(2.0 * np.pi * time)
    way = since_reversal(position, velocity)
    assert way[100] == pytest.approx(1.0, abs=0.02)
    assert way[199] == pytest.approx(2.0, abs=0.02)
    assert way[202] == pytest.approx(0.0, abs=0.02)
    assert way[300] == pytest.approx(1.0, abs=0.02)


def test_usual_effects_are_of_the_catalogue() -> None:
    """Each effect that every machine has a little of is declared, and its usual size is allowed."""
    catalogue = {e.name: e for e in CATALOGUE}
    for usual in USUAL:
        knob = catalogue[usual.name].knob
        assert knob.allows(usual.size(PLANT))
        assert usual.size(PLANT) != knob.off


def test_every_law_states_its_source() -> None:
    """Every law with forms that differ states their source."""
    assert all(form.source and form.law for form in FORMS)
