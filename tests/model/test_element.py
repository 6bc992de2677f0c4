"""The low-pass filters of a sensor's element, against transfer functions and scipy."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from reference_machine import bare, machine
from scipy.integrate import solve_ivp

from hil_emulator.model.effects.cylinder import internal_leakage
from hil_emulator.model.kernel import Kernel, build, zeros
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.sensors import CHANNELS

PERIOD, STEPS = 1e-3, 50
Course = Callable[[np.ndarray], np.ndarray]


def readings(
    model: Kernel, course: Course, ticks: int, steps: int = STEPS, **values: float
) -> np.ndarray:
    """Return what a pressure channel shows at the ticks while its quantity follows a course."""
    sensors = Sensors(model, {"pressure_a": values}, PERIOD, np.random.default_rng(1))
    at, source = sensors.names.index("pressure_a"), model.signals.names.index("pressure_a")
    signals, path = zeros(model.signals), np.zeros((steps, len(sensors.names)))
    shown = np.empty(ticks)
    signals[source] = path[:, at] = course(np.zeros(1))[0]
    sensors.sample(signals, path)
    for k in range(ticks):
        path[:, at] = course(PERIOD * (k + np.arange(1, steps + 1) / steps))
        signals[source] = path[-1, at]
        sensors.sample(signals, path)
        shown[k] = sensors.reading[at]
    return shown


def response(model: Kernel, frequency: float, **values: float) -> complex:
    """Return the ratio of reading to quantity for a sine, once it is steady."""
    omega, ticks = 2.0 * math.pi * frequency, 1000
    shown = readings(model, lambda t: np.sin(omega * t), 2 * ticks, **values)[ticks:]
    phase = omega * PERIOD * np.arange(ticks + 1, 2 * ticks + 1)
    sine, cosine = np.linalg.lstsq(
        np.column_stack([np.sin(phase), np.cos(phase)]), shown, rcond=None
    )[0]
    return complex(sine, cosine)


@pytest.mark.parametrize("steps", [1, STEPS])
@pytest.mark.parametrize("tau", [2e-6, 2e-4, 5e-4, 5e-3])
def test_lag_is_late_by_its_time_constant_on_a_ramp(tau: float, steps: int, model: Kernel) -> None:
    """The steady answer of 1/(1 + tau s) to a ramp trails it by tau, also where tau < a tick."""
    shown = readings(model, lambda t: 1e9 * t, 60, steps, lag_time_constant=tau)
    assert 60 * PERIOD - shown[-1] / 1e9 == pytest.approx(tau, rel=1e-4)


@pytest.mark.parametrize("cut_off", [40.0, 400.0, 5e3])
def test_anti_aliasing_is_late_by_its_damping_on_a_ramp(cut_off: float, model: Kernel) -> None:
    """A low-pass of second order trails a ramp by 2 D/w, sqrt(2)/w for Butterworth's."""
    shown = readings(model, lambda t: 1e9 * t, 100, anti_aliasing_cut_off=cut_off)
    late = math.sqrt(2.0) / (2.0 * math.pi * cut_off)
    assert 100 * PERIOD - shown[-1] / 1e9 == pytest.approx(late, rel=1e-4)


@pytest.mark.parametrize("frequency", [7.0, 130.0, 730.0])
def test_lag_has_amplitude_and_phase_of_first_order(frequency: float, model: Kernel) -> None:
    """Below and above half the rate of the ticks, 1/(1 + j w tau)."""
    exact = 1.0 / (1.0 + 2j * math.pi * frequency * 5e-4)
    assert response(model, frequency, lag_time_constant=5e-4) == pytest.approx(exact, abs=2e-3)


def test_anti_aliasing_passes_half_the_power_at_its_cut_off_and_little_beyond(
    model: Kernel,
) -> None:
    """Butterworth: -3 dB and -90 degrees at 200 Hz; 40 dB per decade, so 1730 Hz hardly folds."""
    at, beyond = (response(model, f, anti_aliasing_cut_off=200.0) for f in (200.0, 1730.0))
    assert at == pytest.approx(-1j * math.sqrt(0.5), abs=2e-3)
    assert abs(beyond) == pytest.approx((200.0 / 1730.0) ** 2, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "rates"),
    [
        ({"lag_time_constant": 5e-4}, lambda x, y: [(x - y[0]) / 5e-4, 0.0]),
        (
            {"anti_aliasing_cut_off": 300.0},
            lambda x, y: [y[1], (600 * math.pi) ** 2 * (x - y[0]) - 600 * math.pi * 2**0.5 * y[1]],
        ),
    ],
    ids=["lag", "anti_aliasing"],
)
def test_filters_follow_a_plant_between_its_ticks(
    values: dict[str, float], rates: Callable[[float, np.ndarray], list[float]], model: Kernel
) -> None:
    """Every reading of a pressure while the rod turns is within 1e-4 of LSODA's solution."""
    plant = Plant(model, machine(load_mass=5.0), 2e-5)
    sensors = Sensors(model, {"pressure_b": values}, PERIOD, np.random.default_rng(1))
    at = sensors.names.index("pressure_b")
    sensors.sample(plant.signal_vector, plant.path)
    course, shown = [float(plant.signals.pressure_b)], []
    for k in range(60):
        plant.inputs.valve_current = 4e-3 if k % 8 < 4 else -4e-3
        plant.step(STEPS)
        course += plant.path[:, at].tolist()
        sensors.sample(plant.signal_vector, plant.path)
        shown.append(float(sensors.reading[at]))
    time = 2e-5 * np.arange(len(course))
    exact = solve_ivp(
        lambda t, y: rates(np.interp(t, time, course), y), (0.0, time[-1]), [course[0], 0.0],
        method="LSODA", rtol=1e-8, atol=1e-2, max_step=2e-5, t_eval=time[STEPS::STEPS],
    )  # fmt: skip
    assert np.ptp(shown) > 20e5
    assert np.abs(shown - exact.y[0]).max() < 1e-4 * np.ptp(shown)


def test_the_path_ends_at_the_signals(model: Kernel) -> None:
    """The last row of the elements' inputs is the channels' signals at the tick."""
    plant = Plant(model, machine(), 2e-5)
    plant.inputs.valve_current = 3e-3
    assert plant.path.shape == (0, 7)
    for steps in (30, 5):
        plant.step(steps)
        names = Sensors(model, {}, PERIOD, np.random.default_rng(1)).names
        assert plant.path.shape == (steps, 7)
        assert plant.path[-1].tolist() == [float(plant.signals[name]) for name in names]
        assert np.all(np.diff(plant.path[:, names.index("spool_position")]) > 0.0)


def test_without_elements_the_path_still_ends_at_the_signals() -> None:
    """A model without an element's effect leaves out the rows before, which are not used."""
    plant = Plant(build((internal_leakage,), compiled=False), bare(), 2e-5)
    plant.inputs.valve_current = 3e-3
    plant.step(3)
    assert plant.path.shape == (3, 7)
    shown = [float(plant.signals[channel.name]) for channel in CHANNELS]
    assert plant.path[-1].tolist() == shown


def test_every_row_of_the_path_is_that_of_its_step(model: Kernel) -> None:
    """A row is the signals after as many steps, also where the rod hits its end.

    There a step is taken in pieces, and the states between the pieces are not recorded.
    """
    near = machine(initial_position=0.0795)
    whole, single = (Plant(model, near, 2e-5) for _ in range(2))
    names = Sensors(model, {}, PERIOD, np.random.default_rng(1)).names
    for _ in range(6):
        for plant in (whole, single):
            plant.inputs.valve_current = 8e-3
        whole.step(STEPS)
        rows = []
        for _ in range(STEPS):
            single.step(1)
            rows.append([float(single.signals[name]) for name in names])
        np.testing.assert_allclose(whole.path, rows, rtol=1e-6, atol=1e-9)
    assert whole.signals.stop_force != 0.0
