"""The valve up to its spool: driver, torque motor, pilot and stops, each in a closed form."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import gain, record, settle
from reference_machine import K_V, STEP, bare, pond
from scipy import signal
from scipy.integrate import solve_ivp

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]


def spool_gain(plant: Plant, frequency: float, amplitude: float) -> float:
    """Amplitude ratio of the spool at one frequency."""

    def drive(value: float) -> None:
        plant.inputs.valve_current = value

    return gain(plant, drive, "spool_position", frequency, amplitude)


def bandwidth(make_plant: MakePlant, values: dict[str, float], amplitude: float) -> float:
    """-3 dB frequency of the spool [Hz], by bisection."""
    low, high = 40.0, 400.0
    while high - low > 1.0:
        middle = 0.5 * (low + high)
        if spool_gain(make_plant(values), middle, amplitude) > math.sqrt(0.5):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def test_transport_delay_ages_the_set_point(make_plant: MakePlant) -> None:
    """A step arrives three ticks late, or in the midst of a tick."""
    plant = make_plant(bare(transport_delay_time=3e-3))
    currents = []
    for current in (0.0, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3):
        plant.inputs.valve_current = current
        plant.step(50)
        currents.append(float(plant.signals.valve_current))
    assert currents == [0.0, 0.0, 0.0, 0.0, 1e-3, 1e-3]


@pytest.mark.parametrize("late", [0.37e-3, 0.5e-3, 2.613e-3])
def test_a_set_point_arrives_when_its_dead_time_is_over(late: float, make_plant: MakePlant) -> None:
    """For any tick, the lag of a driver shows to the microsecond when its current changed."""
    lag, end = 1e-3, 5e-3
    plant = make_plant(bare(transport_delay_time=late, driver_lag_time_constant=lag))
    plant.step(50)
    plant.inputs.valve_current = 1e-3
    for _ in range(round(end / 1e-3)):
        plant.step(50)
    reached = 1e-3 * (1.0 - math.exp(-(end - late) / lag))
    assert plant.signals.valve_current == pytest.approx(reached, rel=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_current_saturation_holds_the_spool_at_the_limit(sign: int, make_plant: MakePlant) -> None:
    """Twice the rated current moves the spool to the rated position."""
    plant = make_plant(bare(current_saturation_limit=0.01, end_stops_stiffness=1e8))
    plant.inputs.valve_current = sign * 0.02
    settle(plant, 0.02)
    assert plant.signals.spool_position == pytest.approx(sign * 0.01, rel=1e-6)


def test_driver_lag_is_first_order(make_plant: MakePlant) -> None:
    """The coil current answers a step as 1 - exp(-t/tau)."""
    plant = make_plant(bare(driver_lag_time_constant=5e-4))
    plant.inputs.valve_current = 1e-3
    (current,) = record(plant, 100, "valve_current")
    t = STEP * np.arange(1, 101)
    assert current == pytest.approx(1e-3 * (1 - np.exp(-t / 5e-4)), rel=1e-6)


def test_null_bias_needs_its_opposite_to_stop_the_rod(make_plant: MakePlant) -> None:
    """The rod drifts at zero command and rests at minus the bias."""
    speeds = []
    for command in (0.0, -1e-4):
        plant = make_plant(bare(null_bias_bias=1e-4, viscous_friction_coefficient=1000.0))
        plant.inputs.valve_current = command
        settle(plant, 0.3)
        speeds.append(float(plant.signals.velocity))
    assert speeds[0] > 5e-3
    assert abs(speeds[1]) < 1e-6


@pytest.mark.parametrize("pressure", [160e5, 210e5, 250e5])
def test_null_shift_is_proportional_to_the_supply_deviation(
    pressure: float, make_plant: MakePlant
) -> None:
    """The null is right at rated supply pressure and moves by its share elsewhere."""
    plant = make_plant(bare(null_shift_shift=2e-4, supply_pressure=pressure))
    settle(plant, 0.02)
    expected = 2e-4 * (pressure / 210e5 - 1.0)
    assert plant.signals.spool_position == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("amplitude", "published"), [(2.5e-3, 250.0), (1e-2, 100.0)])
def test_spool_rate_limit_explains_both_published_bandwidths(
    amplitude: float, published: float, make_plant: MakePlant
) -> None:
    """-3 dB at 250 Hz for ±25 % and at 100 Hz for ±100 %, at 210 bar (S1 3.3.1), within 5 %."""
    values = bare(
        spool_rate_limit_rate=3.6, pilot_supply_share=1.0, supply_pressure=210e5,
        end_stops_stiffness=1e8,
    )  # fmt: skip
    assert bandwidth(make_plant, values, amplitude) == pytest.approx(published, rel=0.05)


def test_pilot_supply_slows_the_spool_as_the_square_root_of_pressure(
    make_plant: MakePlant,
) -> None:
    """From 210 to 160 bar both the linear and the rate-limited bandwidth fall by sqrt(160/210)."""
    ratios = []
    for amplitude in (1e-3, 1e-2):
        times = [
            bandwidth(
                make_plant,
                bare(pilot_supply_share=1.0, spool_rate_limit_rate=3.6, supply_pressure=p),
                amplitude,
            )
            for p in (160e5, 210e5)
        ]
        ratios.append(times[0] / times[1])
    assert ratios == pytest.approx([math.sqrt(160 / 210)] * 2, rel=0.02)


def test_flow_force_closes_the_spool_with_the_drop(make_plant: MakePlant) -> None:
    """Flow force and centring spring share the coil's force: u_v = i / (1 + k dp/dp_n)."""
    plant = make_plant(bare(flow_force_stiffness=0.05, viscous_friction_coefficient=1000.0))
    plant.inputs.valve_current = 2e-3
    settle(plant, 0.06)
    s = plant.signals
    drop = (s.supply_pressure - s.pressure_a) + (s.pressure_b - s.tank_pressure)
    assert s.spool_position == pytest.approx(2e-3 / (1 + 0.05 * drop / 70e5), rel=1e-3)
    assert s.spool_position < 1.95e-3


def test_threshold_is_the_change_that_a_reversal_needs(make_plant: MakePlant) -> None:
    """The spool trails a slow ramp by T and, after a reversal, rests until the ramp is back 2 T."""
    plant = make_plant(bare(threshold_current=1e-4))
    ramp = np.concatenate([np.arange(0, 1e-3, 1e-6), np.arange(1e-3, 0, -1e-6)])
    spool = np.empty(len(ramp))
    for i, current in enumerate(ramp):
        plant.inputs.valve_current = current
        plant.step(50)
        spool[i] = plant.signals.spool_position
    assert ramp[900] - spool[900] == pytest.approx(1e-4, rel=0.05)
    resting = np.flatnonzero(np.abs(np.diff(spool[1000:])) < 1e-8)
    assert len(resting) * 1e-6 == pytest.approx(2e-4, rel=0.1)


@pytest.mark.parametrize("time_constant", [1e-4, 1e-3])
def test_pilot_lag_makes_a_valve_of_third_order(
    time_constant: float, make_plant: MakePlant
) -> None:
    """A step of current: scipy's solution of the transfer function, where it rings, too."""
    w, damping = 2 * math.pi * 250.0, 0.7
    third = [time_constant, 1 + 2 * damping * w * time_constant, 2 * damping * w, w * w]
    t = STEP * np.arange(501)
    exact = signal.lsim(([w * w], third), np.full(501, 1e-3), t)[1]
    plant = make_plant(bare(pilot_lag_time_constant=time_constant))
    plant.inputs.valve_current = 1e-3
    (spool,) = record(plant, 500, "spool_position")
    assert spool == pytest.approx(exact[1:], abs=1e-3 * 1e-3)
    assert (exact.max() > 1.3e-3) == (time_constant == 1e-3)


@pytest.mark.parametrize("transducer", ["spool_position", "flow_a"])
def test_hysteresis_opens_a_loop_of_the_stated_width(
    transducer: str, make_plant: MakePlant
) -> None:
    """On a slow triangle the same spool position, so the same flow, needs 0.2 mA less falling.

    The loop is that of the torque motor, so a transducer of the spool shows it; rate is no matter.
    """
    widths = []
    for steps in (10_000, 20_000):
        plant = make_plant(pond(hysteresis_width=2e-4))
        up = np.linspace(-5e-3, 5e-3, steps)
        recorded = []
        for current in [*up, *up[::-1]]:
            plant.inputs.valve_current = current
            plant.step(1)
            recorded.append(float(plant.signals[transducer]))
        at = steps * 3 // 4
        root = math.sqrt(plant.signals.supply_pressure - plant.signals.pressure_a)
        gain = 1.0 if transducer == "spool_position" else K_V * root
        # the spool itself trails a ramp by 2 D/w, on both branches
        trail = 2 * 0.7 / (2 * math.pi * 250) * 1e-2 / (steps * STEP)
        widths.append((recorded[steps:][::-1][at] - recorded[at]) / gain - 2 * trail)
    assert widths == pytest.approx([2e-4] * 2, rel=0.03)


def with_stops(current: float, duration: float, start: np.ndarray, limit: float) -> np.ndarray:
    """Position and speed of S1's spool between stops, by scipy: struck, held, let go."""
    w, damping = 2 * math.pi * 250.0, 0.7

    def free(_: float, y: np.ndarray) -> list[float]:
        return [y[1], w * w * (current - y[0]) - 2 * damping * w * y[1]]

    def struck(_: float, y: np.ndarray) -> float:
        return limit - abs(float(y[0]))

    struck.terminal, struck.direction = True, -1  # type: ignore[attr-defined]
    if abs(start[0]) >= limit and current * start[0] >= limit * limit:
        return np.array([start[0], 0.0])
    solution = solve_ivp(free, (0.0, duration), start, events=struck, rtol=1e-10, atol=1e-12)
    if solution.status == 0:
        return np.asarray(solution.y[:, -1])
    at_stop = np.array([math.copysign(limit, solution.y[0, -1]), 0.0])
    return with_stops(current, duration - solution.t[-1], at_stop, limit)


@pytest.mark.parametrize("top", [0.01, 0.015])
def test_spool_stops_take_the_spool_without_rebound(top: float, make_plant: MakePlant) -> None:
    """Driven to and beyond its stops, the spool follows an exact solution with events."""
    plant = make_plant(bare(spool_stops_limit=0.01, end_stops_stiffness=1e8))
    exact = np.zeros(2)
    worst = highest = 0.0
    for current in (top, top, top, 0.004, -top, -top, -top, 0.0, top, 0.009):
        plant.inputs.valve_current = current
        for _ in range(10):
            exact = with_stops(current, 2e-4, exact, 0.01)
            plant.step(10)
            worst = max(worst, abs(float(plant.signals.spool_position) - exact[0]))
            highest = max(highest, abs(float(plant.signals.spool_position)))
    assert highest == 0.01
    assert worst < 1e-5
