"""Finite differences of the residual."""

import numpy as np
import pandas
import pytest

import hil_emulator as hil
from hil_emulator.api.reading import as_experiments
from hil_emulator.identify.estimation.finite_difference import (
    DIFFERENCE,
    LARGEST_CHANGE,
    Derivative,
    Steps,
)
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model

SMALL = 1e-4
"""Step at which the quotients below are exact, in prior standard deviations."""


def _healthy(duration: str) -> pandas.DataFrame:
    """Return a log of the configured machine: 0.5 mA, from 1 Hz upwards by 1 Hz in 3 s."""
    return hil.load("hyq_knee").simulate(
        lambda t: 5e-4 * np.sin(2.0 * np.pi * t * (1.0 + t / 6.0)), duration
    )


def test_the_first_jacobian_is_not_biased_by_noise() -> None:
    """A column is the central difference of the innovations without the robust loss.

    At first the sensitivity is unknown, and the step of the valve gain exceeds the quadratic range
    of the loss.
    """
    model = knee_model()
    observer = Observer(model, (*INSTRUMENTS, "spool_position"))
    fitter = Fitter(observer, as_experiments(_healthy("6 s"), 1))
    gain = [c for c in parameters.ordinary(model) if c.name == "valve_gain"]
    fitter.freeze(gain, np.zeros(1))
    column = fitter.jacobian(gain, np.zeros(1), fitter.residual(gain, np.zeros(1)))[:, 0]

    def innovations(at: float) -> Array:
        innovations = observer.innovations(fitter.frozen[0], *model.memory(gain, np.array([at])))[0]
        return np.nan_to_num(innovations.ravel())

    exact = (innovations(SMALL) - innovations(-SMALL)) / (2.0 * SMALL)
    assert np.linalg.norm(column - exact) < 0.02 * np.linalg.norm(exact)


@pytest.mark.parametrize(("at", "step"), [(-2.0, DIFFERENCE), (-1.0, 2e-6)])
def test_a_step_from_a_bound_is_not_shortened(at: float, step: float) -> None:
    """Without air the pressure falls below vacuum, with a trace of air it does not.

    A difference quotient over this jump grows with a shorter step, which would be shortened without
    end.
    """
    air = [c for c in parameters.ordinary(knee_model()) if c.name == "entrained_air"]
    assert air[0].bounds[0] == -2.0
    wanted, steps = Derivative(air, np.array([at]), 0), Steps()
    steps.learn(wanted, np.full(1, LARGEST_CHANGE / 2e-6))
    assert steps.of(wanted) == pytest.approx(step)


@pytest.mark.full(sibling="test_the_first_jacobian_is_not_biased_by_noise")
def test_a_healthy_machine_agrees_with_its_configuration() -> None:
    """Simulated with the configuration itself, a sweep of 1 to 3 Hz: nothing disagrees."""
    assert hil.gap(hil.load("hyq_knee"), _healthy("6 s")).verdict == "agrees"
