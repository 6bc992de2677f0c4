"""The physics of waves in the lines between valve and cylinder."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import record, settle
from numpy.typing import NDArray
from reference_machine import STEP, bare, pond
from scipy.optimize import fsolve
from scipy.special import jv

from hil_emulator.model.kernel import zeros
from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
Vector = NDArray[np.float64]
SPEED, DENSITY, BORE, AREA, ALPHA, MODULUS = 1237.0, 850.0, 6e-3, 2.0106e-4, 0.61, 1.3e9
IMPEDANCE = DENSITY * SPEED / (math.pi / 4.0 * BORE**2)
CELLS = 50
LONG = CELLS * SPEED * STEP
"""A line that a wave passes in a whole number of steps: 1.2 m."""


def characteristics(inflow: Vector) -> tuple[Vector, Vector]:
    """Return pressure at the valve and flow at the chamber, whose pressure is 0, without losses.

    Method of characteristics: p + Z q runs with the wave, p - Z q against it.
    """
    pressure, flow = np.zeros(CELLS + 1), np.full(CELLS + 1, inflow[0])
    recorded = np.empty((2, len(inflow)))
    for k, drawn in enumerate(inflow):
        along, against = pressure + IMPEDANCE * flow, pressure - IMPEDANCE * flow
        pressure[1:-1] = 0.5 * (along[:-2] + against[2:])
        flow[1:-1] = 0.5 * (along[:-2] - against[2:]) / IMPEDANCE
        flow[0], pressure[0] = drawn, against[1] + IMPEDANCE * drawn
        pressure[-1], flow[-1] = 0.0, along[-2] / IMPEDANCE
        recorded[:, k] = pressure[0], flow[-1]
    return recorded[0], recorded[1]


def stopped(make_plant: MakePlant, at_once: bool) -> tuple[Vector, Vector, Vector]:
    """Shut the valve; return surge at the valve over rho c v, flows there and at the chamber."""
    plant = make_plant(pond(line_waves_length=LONG, oil_kinematic_viscosity=1e-7,
                            valve_natural_frequency=250.0))  # fmt: skip
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.5)
    before, flow = float(plant.signals.port_pressure_a), float(plant.signals.flow_a)
    plant.inputs.valve_current = 0.0
    if at_once:
        plant.state.spool_position = 0.0
    pressure, drawn, given = record(plant, 8 * CELLS, "port_pressure_a", "port_flow_a", "flow_a")
    return (before - pressure) / (IMPEDANCE * flow), drawn / flow, given / flow


def test_line_waves_surge_by_rho_c_v_as_a_square_wave(make_plant: MakePlant) -> None:
    """A sudden stop: rho c v until the wave is back from the chamber, then as much the other way.

    Few modes need a quarter of the wave's way to turn, and overshoot by 3 %.
    """
    surge, drawn, _ = stopped(make_plant, at_once=True)
    assert np.abs(drawn).max() < 1e-12
    exact = -characteristics(np.r_[1.0, drawn])[0][1:] / IMPEDANCE
    assert np.abs(exact) == pytest.approx(1.0)
    assert surge.max() == pytest.approx(1.0, abs=0.03)
    turning = np.arange(len(surge)) % (2 * CELLS)
    flat = (turning > CELLS // 2) & (turning < 3 * CELLS // 2)
    assert surge[flat] == pytest.approx(exact[flat], abs=0.04)


def test_line_waves_follow_the_method_of_characteristics(make_plant: MakePlant) -> None:
    """A spool of 250 Hz shuts the line: pressure at one end and flow at the other, two periods.

    The inertance that few modes lack makes them weaker by 6 % of rho c v.
    """
    surge, drawn, given = stopped(make_plant, at_once=False)
    pressure, flow = characteristics(np.r_[1.0, drawn])
    off = np.abs(surge + pressure[1:] / IMPEDANCE)
    assert (off.max(), off.mean()) < (0.11, 0.05)
    assert np.abs(given - flow[1:]).mean() < 0.05


def exact_modes(length: float, viscosity: float) -> NDArray[np.complex128]:
    """Return the first four roots of cosh(Gamma) [rad/s]: the distributed line, valve closed.

    Gamma = l s/c / √(1 - 2 J1(k)/(k J0(k))), k = j r √(s/nu) (Zielke 1968; Goodson & Leonard 1972).
    """

    def mismatch(v: Vector, quarter: float) -> list[float]:
        s = complex(v[0], v[1])
        k = 0.5j * BORE * np.sqrt(s / viscosity)
        gamma = length * s / SPEED / np.sqrt(1.0 - 2.0 * jv(1, k) / (k * jv(0, k)))
        return [gamma.real, gamma.imag - quarter]

    roots = []
    for quarter in 0.5 * math.pi * np.array([1, 3, 5, 7]):
        root = fsolve(
            mismatch, np.array([-0.02, 0.97]) * quarter * SPEED / length, (quarter,), xtol=1e-12
        )
        roots.append(complex(root[0], root[1]))
    return np.array(roots)


@pytest.mark.parametrize(("length", "viscosity"), [(1.0, 46e-6), (4.0, 46e-6), (1.0, 15e-6)])
def test_line_waves_ring_at_the_roots_of_the_distributed_line(
    make_plant: MakePlant, length: float, viscosity: float
) -> None:
    """Four resonances within 0.5 %, their damping within 2 %; without loss at c (2n - 1)/(4 l)."""
    plant = make_plant(pond(line_waves_length=length, oil_kinematic_viscosity=viscosity))
    names = plant.kernel.state.names
    at = [i for i, name in enumerate(names) if name.startswith("line_waves_") and "_a" in name]
    state, rates = plant.state_vector.copy(), zeros(plant.kernel.state)
    jacobian = np.empty((len(at), len(at)))
    for column, i in enumerate(at):
        size = 1.0 if "pressure" in names[i] else 1e-9
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[i] += sign * size
            plant.kernel.rate(moved, rates, plant.parameter_vector, plant.input_vector,
                              plant.signal_vector)  # fmt: skip
            jacobian[:, column] = rates[at] - jacobian[:, column] if sign < 0.0 else rates[at]
        jacobian[:, column] /= -2.0 * size
    modes = np.linalg.eigvals(jacobian)
    modes = np.sort_complex(1j * modes[modes.imag > 0.0])[::-1] / 1j
    exact = exact_modes(length, viscosity)
    assert modes.imag == pytest.approx(exact.imag, rel=5e-3)
    assert modes.real == pytest.approx(exact.real, rel=0.02)
    lossless = 0.5 * math.pi * np.array([1, 3, 5, 7]) * SPEED / length
    assert np.all(modes.imag / lossless > 0.9)
    assert np.all(modes.imag < lossless)


@pytest.mark.parametrize(("current", "diameter"), [(1e-3, 6e-3), (1e-2, 4e-3)])
def test_line_waves_lose_pressure_as_pipes_do(
    make_plant: MakePlant, current: float, diameter: float
) -> None:
    """Hagen-Poiseuille 128 mu l q/(pi d^4), or Blasius 0.241 rho^¾ mu^¼ l q^1.75/d^4.75; as heat.

    What enters a line at rest leaves it.
    """
    plant = make_plant(pond(line_waves_length=1.0, line_waves_diameter=diameter))
    plant.inputs.valve_current = current
    settle(plant, 0.3)
    s = plant.signals
    mu, q = DENSITY * 46e-6, float(s.flow_a)
    laminar = 128.0 * mu * q / (math.pi * diameter**4)
    turbulent = 0.241 * DENSITY**0.75 * mu**0.25 * q**1.75 / diameter**4.75
    assert (turbulent > laminar) == (current == 1e-2)
    lost = s.port_pressure_a - s.pressure_a
    assert lost == pytest.approx(max(laminar, turbulent), rel=5e-3)
    assert s.port_flow_a == pytest.approx(q, rel=1e-4)
    assert s.port_flow_b == pytest.approx(s.flow_b, rel=1e-4)
    both = lost * q + (s.pressure_b - s.port_pressure_b) * s.flow_b
    assert s.line_loss == pytest.approx(both, rel=5e-3)


def test_line_waves_lose_zeta_times_the_dynamic_pressure(make_plant: MakePlant) -> None:
    """The same line with and without bends of zeta = 20: 20 rho v²/2 more."""
    drops, flows = [], []
    for zeta in (0.0, 20.0):
        plant = make_plant(pond(line_waves_length=1.0, line_waves_form_losses=zeta))
        plant.inputs.valve_current = 5e-3
        settle(plant, 0.3)
        drops.append(plant.signals.port_pressure_a - plant.signals.pressure_a)
        flows.append(float(plant.signals.flow_a))
    speed = flows[1] / (math.pi * 6e-3**2 / 4)
    wall = drops[0] * flows[1] / flows[0]
    assert drops[1] - wall == pytest.approx(20 * DENSITY * speed**2 / 2, rel=0.02)


def test_line_waves_hold_their_oil(make_plant: MakePlant) -> None:
    """Behind a closed valve the rod is held by two springs of oil, chamber and line in each."""
    plant = make_plant(bare(valve_gain=1e-30, line_waves_length=2.0, load_mass=5.0,
                            load_viscous_friction_coefficient=5e3))  # fmt: skip
    before = float(plant.signals.position)
    plant.inputs.external_force = 300.0
    settle(plant, 0.5)
    line = 2.0 * math.pi / 4.0 * BORE**2 / (DENSITY * SPEED**2)
    chamber_a = (3e-6 + AREA * before) / MODULUS + line
    chamber_b = (3e-6 + ALPHA * AREA * (0.08 - before)) / MODULUS + line
    stiffness = AREA**2 * (1.0 / chamber_a + ALPHA**2 / chamber_b)
    assert before - plant.signals.position == pytest.approx(300.0 / stiffness, rel=5e-3)


def test_line_waves_end_at_the_valves_that_hold_the_load(make_plant: MakePlant) -> None:
    """Closed ones part the line from a chamber that the load squeezes."""
    plant = make_plant(bare(line_waves_length=1.0, shut_off_valves_closing_time=0.02,
                            lines_closed=1.0, load_viscous_friction_coefficient=5e3))  # fmt: skip
    settle(plant, 0.2)
    port = float(plant.signals.port_pressure_a)
    plant.inputs.external_force = 1000.0
    settle(plant, 0.2)
    s = plant.signals
    assert s.pressure_a > port + 20e5
    assert s.port_pressure_a == pytest.approx(port, rel=1e-3)
    assert s.block_pressure_a == pytest.approx(port, rel=1e-3)
