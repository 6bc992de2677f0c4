"""The formulas behind the procedures, on numbers made without the emulator."""

import math

import numpy as np
import pytest

from hil_emulator.characterise.friction_force import fit
from hil_emulator.characterise.procedures.bulk_modulus import mixture
from hil_emulator.characterise.procedures.force_zeros import fit_zeros
from hil_emulator.characterise.procedures.natural_frequency import ringing_pole
from hil_emulator.characterise.procedures.no_load import expected_pressures
from hil_emulator.characterise.procedures.root_locus import gain_margin, largest_stable, roots
from hil_emulator.characterise.result import Series
from hil_emulator.characterise.sine import crossing, fundamental


def test_a_fundamental_is_found_under_offset_drift_and_harmonics() -> None:
    """Amplitude and phase of a sine come back from 3.7 periods with offset and drift."""
    time = np.arange(0.0, 3.7, 1e-3)
    omega = 2.0 * math.pi
    values = 5.0 + 0.3 * time + 2.0 * np.sin(omega * time + 0.5)
    result = fundamental(time, values, omega)
    assert abs(result) == pytest.approx(2.0)
    assert np.angle(result) == pytest.approx(0.5)


def test_a_first_order_lag_is_3_db_down_at_its_corner() -> None:
    """The crossing is interpolated between the points of a sweep."""
    hertz = np.geomspace(1.0, 1000.0, 40)
    level = -10.0 * np.log10(1.0 + (hertz / 100.0) ** 2)
    assert crossing(hertz, level, -3.0103) == pytest.approx(100.0, rel=0.01)
    assert math.isnan(crossing(hertz, level, -100.0))


def test_zeros_come_back_from_the_ratio_of_two_forces() -> None:
    """(s + 10)/(s + 30) with a gain of 0.98 gives -10 and -30."""
    omega: Series = np.geomspace(2.0, 100.0, 9)
    s = 1j * omega
    assert fit_zeros(omega, 0.98 * (s + 10.0) / (s + 30.0)) == pytest.approx((-10.0, -30.0))


def test_friction_coefficients_come_back_from_their_own_curve() -> None:
    """S1 eq. 3.18 with the numbers of its Fig. 3.8 and an offset of the sensors."""
    v = np.concatenate([np.linspace(-0.3, -0.004, 800), np.linspace(0.004, 0.3, 800)])
    force = 7.0 + 1000.0 * v + np.sign(v) * (100.0 + 100.0 * np.exp(-np.abs(v) / 0.02))
    result = fit(v, force, excess=True)
    assert result.zero == pytest.approx(7.0, abs=0.1)
    assert result.viscous == pytest.approx(1000.0, rel=0.01)
    assert result.coulomb == pytest.approx(100.0, rel=0.02)
    assert result.excess == pytest.approx(100.0, rel=0.03)
    assert result.stribeck_velocity == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize("pressure", [0.5e5, 5e5, 50e5, 300e5])
def test_the_modulus_of_the_mixture_is_minus_v_dp_dv(pressure: float) -> None:
    """S2 eq. 1 as corrected is the derivative of oil volume plus gas volume."""
    modulus, fraction, k = 1.3e9, 0.01, 1.4

    def oil(p: float) -> float:
        return math.exp(-p / modulus)

    def volume(p: float) -> float:
        gas: float = fraction * (101_325.0 / p) ** (1.0 / k)
        return oil(p) + gas

    step = 1e-4 * pressure
    slope = (volume(pressure + step) - volume(pressure - step)) / (2.0 * step)
    # the expression counts air by the volume that the oil has at this pressure
    result = mixture(np.array([pressure]), modulus, fraction / oil(pressure), k)
    assert result[0] == pytest.approx(-volume(pressure) / slope, rel=1e-6)


def test_the_mixture_is_oil_without_air_and_gas_near_vacuum() -> None:
    """Both limits of S2 eq. 1: E for no air, kappa p where gas fills the chamber."""
    p = np.array([1.0, 1e5, 200e5])
    assert mixture(p, 1.3e9, 0.0, 1.4) == pytest.approx([1.3e9] * 3)
    assert mixture(p, 1.3e9, 0.2, 1.4)[0] == pytest.approx(1.4, rel=2e-3)


def test_no_load_pressures_balance_forces_and_flows() -> None:
    """p_a = alpha p_b on the rod, and the drops at the edges differ by alpha²."""
    alpha, supply, tank = 0.61, 160e5, 1e5
    p_a, p_b = expected_pressures(alpha, supply, tank, extends=True)
    assert p_a == pytest.approx(alpha * p_b)
    assert alpha * math.sqrt(supply - p_a) == pytest.approx(math.sqrt(p_b - tank))
    p_a, p_b = expected_pressures(alpha, supply, tank, extends=False)
    assert p_a == pytest.approx(alpha * p_b)
    assert alpha * math.sqrt(p_a - tank) == pytest.approx(math.sqrt(supply - p_b))


def test_a_ringing_pole_comes_back_from_its_own_decay() -> None:
    """60 Hz with 4 % of damping, under noise of 1 % of the first swing."""
    time = 1e-3 * np.arange(200)
    pole = 2.0 * math.pi * 60.0 * complex(-0.04, math.sqrt(1.0 - 0.04**2))
    noise = np.random.default_rng(1).normal(0.0, 0.01, time.size)
    result = ringing_pole(np.real((0.6 + 0.8j) * np.exp(pole * time)) + noise, 1e-3)
    assert abs(result) == pytest.approx(abs(pole), rel=1e-3)
    assert -result.real / abs(result) == pytest.approx(0.04, rel=0.02)


def test_three_equal_lags_swing_at_a_gain_of_eight() -> None:
    """1/(s + 1)³ in a loop: roots -1 + k^(1/3) exp(j pi/3 (1, 3, 5)), so Routh's limit is 8."""
    lags = (np.array([1.0]), np.poly([-1.0] * 3))
    at_limit = np.sort_complex(roots(*lags, np.array([8.0]))[0])
    assert at_limit == pytest.approx(np.array([-3.0, -(3**0.5) * 1j, 3**0.5 * 1j]), abs=1e-6)
    assert gain_margin(*lags) == pytest.approx(8.0, rel=1e-3)
    gains: Series = np.geomspace(1.0, 100.0, 200)
    assert largest_stable(gains, roots(*lags, gains)) == pytest.approx(8.0, rel=1e-3)
