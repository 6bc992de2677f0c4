"""The physics of the valve's effects, each in a closed form, a limit or a published number."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import gain, lock, record, settle
from reference_machine import STEP, ballistic, bare, pond
from scipy import signal
from scipy.integrate import solve_ivp

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
P_S, P_T, K_V = 160e5, 1e5, 6.68e-6


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
    """A step arrives three ticks late; a delay of half a tick averages two ticks."""
    plant = make_plant(bare(transport_delay_time=3e-3))
    seen = []
    for current in (0.0, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3):
        plant.inputs.valve_current = current
        plant.step(50)
        seen.append(float(plant.signals.valve_current))
    assert seen == [0.0, 0.0, 0.0, 0.0, 1e-3, 1e-3]
    plant = make_plant(bare(transport_delay_time=0.5e-3))
    plant.step(50)
    plant.inputs.valve_current = 1e-3
    plant.step(50)
    assert plant.signals.valve_current == pytest.approx(0.5e-3)


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
        found = [
            bandwidth(
                make_plant,
                bare(pilot_supply_share=1.0, spool_rate_limit_rate=3.6, supply_pressure=p),
                amplitude,
            )
            for p in (160e5, 210e5)
        ]
        ratios.append(found[0] / found[1])
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
        seen = []
        for current in [*up, *up[::-1]]:
            plant.inputs.valve_current = current
            plant.step(1)
            seen.append(float(plant.signals[transducer]))
        at = steps * 3 // 4
        root = math.sqrt(plant.signals.supply_pressure - plant.signals.pressure_a)
        gain = 1.0 if transducer == "spool_position" else K_V * root
        # the spool itself trails a ramp by 2 D/w, on both branches
        trail = 2 * 0.7 / (2 * math.pi * 250) * 1e-2 / (steps * STEP)
        widths.append((seen[steps:][::-1][at] - seen[at]) / gain - 2 * trail)
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
    found = solve_ivp(free, (0.0, duration), start, events=struck, rtol=1e-10, atol=1e-12)
    if found.status == 0:
        return np.asarray(found.y[:, -1])
    at_stop = np.array([math.copysign(limit, found.y[0, -1]), 0.0])
    return with_stops(current, duration - found.t[-1], at_stop, limit)


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


def test_gain_asymmetry_is_the_ratio_of_both_speeds(make_plant: MakePlant) -> None:
    """A symmetric cylinder runs (1 + k)/(1 - k) times faster in the favoured direction."""
    speeds = []
    for current in (1e-3, -1e-3):
        plant = make_plant(
            bare(
                gain_asymmetry_asymmetry=0.05, cylinder_area_ratio=1.0, load_mass=5.0,
                viscous_friction_coefficient=100.0,
            )
        )  # fmt: skip
        plant.inputs.valve_current = current
        settle(plant, 0.15)
        speeds.append(abs(float(plant.signals.velocity)))
    assert speeds[0] / speeds[1] == pytest.approx(1.05 / 0.95, rel=2e-3)


def test_overlap_takes_its_lap_from_the_opening(make_plant: MakePlant) -> None:
    """Nothing flows within the lap; beyond it the flow grows as u - lap."""
    flows = []
    for current in (0.9e-4, 2e-4, 3e-4):
        plant = make_plant(pond(overlap_lap=1e-4, valve_critical_reynolds_number=0.0))
        plant.inputs.valve_current = current
        settle(plant, 0.02)
        flows.append(float(plant.signals.flow_a))
    assert flows[0] == 0.0
    assert flows[2] / flows[1] == pytest.approx(2.0, rel=1e-5)


EDGES = {"sa": (1, "a", P_S), "at": (-1, "a", P_T), "sb": (-1, "b", P_S), "bt": (1, "b", P_T)}
"""Of each edge: sign of the travel that opens it, its chamber, the pressure beyond it."""


def one_unlike_three(make_plant: MakePlant, unlike: str, lap: float, gain: float) -> None:
    """Hold four edges against q = K_v (1 + g) (u - lap) sqrt(dp), with one of another land."""
    own = {f"lap_{unlike}_lap": lap, f"gain_{unlike}_excess": gain}
    plant = make_plant(pond(**own, valve_critical_reynolds_number=0.0, valve_laminar_width=1e3))
    for edge, (sign, chamber, beyond) in EDGES.items():
        plant.set_pressures(80e5, 80e5)
        plant.state.spool_position = sign * 1e-3
        plant.step(0)
        opening = (1.0 + gain) * (1e-3 - lap) if edge == unlike else 1e-3
        flow = K_V * opening * math.sqrt(abs(beyond - 80e5))
        assert sign * plant.signals[f"flow_{chamber}"] == pytest.approx(flow, rel=1e-6)


def test_lap_sa_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-A opens 0.2 mA late; the others as ever."""
    one_unlike_three(make_plant, "sa", 2e-4, 0.0)


def test_lap_at_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """A-T opens 0.1 mA early."""
    one_unlike_three(make_plant, "at", -1e-4, 0.0)


def test_lap_sb_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-B opens 0.2 mA late."""
    one_unlike_three(make_plant, "sb", 2e-4, 0.0)


def test_lap_bt_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """B-T opens 0.1 mA early."""
    one_unlike_three(make_plant, "bt", -1e-4, 0.0)


def test_gain_sa_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-A is 5 % wider than the others."""
    one_unlike_three(make_plant, "sa", 0.0, 0.05)


def test_gain_at_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """A-T is 5 % narrower, and has a lap as well."""
    one_unlike_three(make_plant, "at", 2e-4, -0.05)


def test_gain_sb_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-B is 5 % wider."""
    one_unlike_three(make_plant, "sb", 0.0, 0.05)


def test_gain_bt_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """B-T is 5 % narrower, and open at null."""
    one_unlike_three(make_plant, "bt", -1e-4, -0.05)


def test_edges_of_different_lap_share_the_pressure_of_a_blocked_port(make_plant: MakePlant) -> None:
    """At null equal flows pass both edges of a: (p_s - p_a) u_sa² = (p_a - p_t) u_at².

    Of an underlap of 3 % P-A has lost 2 %, A-T has won 1 %; chamber b, unlike a, stays halfway.
    """
    plant = make_plant(bare(underlap_lap=3e-4, lap_sa_lap=2e-4, lap_at_lap=-1e-4, load_mass=1e5,
                            valve_critical_reynolds_number=0.0))  # fmt: skip
    lock(plant, 1.0)
    shares = 1.0**2, 4.0**2
    expected = (shares[0] * P_S + shares[1] * P_T) / sum(shares)
    assert plant.signals.pressure_a == pytest.approx(expected, rel=0.01)
    assert plant.signals.pressure_b == pytest.approx(0.5 * (P_S + P_T), rel=0.01)


def test_underlap_gives_the_published_pressure_sensitivity(make_plant: MakePlant) -> None:
    """Blocked ports: dp/du = p_s/u_0, 5.7e11 Pa/A for 28 uA (S1 3.5.1), within 2 %."""
    pressures = []
    for current in (-1e-6, 1e-6):
        plant = make_plant(bare(underlap_lap=28e-6, load_mass=1e5, tank_pressure=0.0,
                                valve_critical_reynolds_number=0.0))  # fmt: skip
        plant.inputs.valve_current = current
        lock(plant, 2.0)
        pressures.append((plant.signals.pressure_a, plant.signals.pressure_b))
        leakage = plant.signals.supply_flow
    (a_below, b_below), (a_above, b_above) = pressures
    assert (a_above - a_below) / 2e-6 == pytest.approx(5.7e11, rel=0.02)
    assert (b_above - b_below) / 2e-6 == pytest.approx(-5.7e11, rel=0.02)
    # and the leakage that comes with it where flow is turbulent: 2 K_v u_0 sqrt(p_s/2), 0.064 l/min
    assert leakage == pytest.approx(2 * K_V * 28e-6 * math.sqrt(P_S / 2), rel=0.01)


def test_flow_saturation_lets_edge_and_passage_share_the_drop(make_plant: MakePlant) -> None:
    """At the passage's own opening the flow is 1/sqrt(2) of that without it."""
    flows = []
    for passage in (math.inf, 5e-3):
        plant = make_plant(pond(flow_saturation_passage=passage))
        plant.inputs.valve_current = 5e-3
        plant.step(400)
        s = plant.signals
        flows.append(s.flow_a / math.sqrt(s.supply_pressure - s.pressure_a))
    assert flows[1] / flows[0] == pytest.approx(math.sqrt(0.5), rel=1e-4)


SLOT, RHO, C_D = 0.025, 850.0, 0.6
WIDTH = K_V * math.sqrt(RHO / 2) / (C_D * SLOT)
"""Width of an edge's slot [m]: its area is what K_v u stands for at C_d = 0.6."""


def through(plant: Plant, current: float) -> tuple[float, float]:
    """Return flow and drop of the edge from s to a, with the spool held."""
    plant.inputs.valve_current = current
    plant.state.spool_position = current
    plant.step(0)
    return float(plant.signals.flow_a), float(
        plant.signals.supply_pressure - plant.state.pressure_a
    )


@pytest.mark.parametrize("viscosity", [46e-6, 200e-6])
def test_a_narrow_edge_passes_what_creeps_through_a_slit(
    viscosity: float, make_plant: MakePlant
) -> None:
    """Flow is pi x² w dp/(32 mu), exact for Stokes' equations (Wuest 1954), within 1 %."""
    plant = make_plant(pond(oil_kinematic_viscosity=viscosity, valve_laminar_width=1e3))
    for pressure in (159.9e5, 155e5, 130e5):
        plant.set_pressures(pressure, 80e5)
        flow, drop = through(plant, 5e-5)
        slot = SLOT * 5e-5
        creeping = math.pi * slot**2 * WIDTH * drop / (32 * viscosity * RHO)
        assert flow == pytest.approx(creeping, rel=0.01)


def test_a_wide_edge_is_turbulent(make_plant: MakePlant) -> None:
    """At Re = 1000 the flow is C_d x w sqrt(2 dp/rho) with C_d = 0.6 (S1 3.3.2), within 0.1 %."""
    plant = make_plant(pond())
    flow, drop = through(plant, 1e-2)
    speed = math.sqrt(2 * drop / RHO)
    assert 2 * flow / (WIDTH * 46e-6) > 900
    assert flow == pytest.approx(C_D * SLOT * 1e-2 * WIDTH * speed, rel=1e-3)


def test_one_law_leads_from_laminar_to_turbulent(make_plant: MakePlant) -> None:
    """Flow grows with a power of the drop between 1 and 1/2, from there to there, at any opening.

    The Reynolds number of the change, 2 q/(w nu) of a slit, is one and the same.
    """
    changes = []
    for current in (1e-4, 3e-4, 1e-3):
        plant = make_plant(pond(valve_laminar_width=1e3, supply_pressure=400e5))
        points = []
        for drop in np.geomspace(10.0, 390e5, 80):
            plant.set_pressures(400e5 - float(drop), 80e5)
            points.append(through(plant, current))
        flow, drop = np.log(np.array(points)).T
        power = np.diff(flow) / np.diff(drop)
        assert np.all(np.diff(power) < 1e-3)
        assert power[0] == pytest.approx(1.0, abs=0.01 if current < 5e-4 else 0.1)
        assert 0.49 < power[-1] < (0.55 if current > 2e-4 else 0.8)
        changes.append(2 * math.exp(np.interp(-0.75, -power, flow[1:])) / (WIDTH * 46e-6))
    assert changes == pytest.approx([changes[0]] * 3, rel=0.1)


def blocked(make_plant: MakePlant, current: float, **values: float) -> Plant:
    """Return a valve with blocked ports, 0.3 ml behind each, at their steady pressures."""
    drillings = {"cylinder_dead_volume_a": 3e-7, "cylinder_dead_volume_b": 3e-7}
    still = {"tank_pressure": 0.0, "valve_laminar_width": 1e3, **drillings}
    plant = make_plant(ballistic(**still, **values))
    plant.inputs.valve_current = plant.state.spool_position = current
    settle(plant, 1.0)
    return plant


def test_underlap_gives_the_same_null_in_laminar_and_turbulent_flow(make_plant: MakePlant) -> None:
    """Both edges of a blocked port balance opening times root of the drop, whatever the law."""
    pressures = []
    for critical in (0.0, 14.7, 500.0):
        law = {"valve_critical_reynolds_number": critical}
        plant = blocked(make_plant, 4e-5, underlap_lap=1e-4, **law)
        pressures.append(float(plant.signals.pressure_a))
    share = 1.4**2 / (1.4**2 + 0.6**2)
    assert pressures == pytest.approx([P_S * share] * 3, rel=1e-3)


def test_land_leakage_gives_the_published_pressure_sensitivity(make_plant: MakePlant) -> None:
    """Zero lap with a clearance worth 28 uA: dp/du = 5.7e11 Pa/A as well (S1 3.5.1), within 2 %."""
    below, above = (
        blocked(make_plant, current, land_leakage_clearance=28e-6) for current in (-2e-7, 2e-7)
    )
    rise = float(above.signals.pressure_a - below.signals.pressure_a)
    assert rise / 4e-7 == pytest.approx(5.7e11, rel=0.02)


def test_land_leakage_has_a_peak_at_null_and_a_foot_of_an_annular_gap(
    make_plant: MakePlant,
) -> None:
    """Past an overlap z the leakage falls as 1/(z + l), to that of a gap w c³ dp/(12 mu z)."""
    clearance = 28e-6
    laps = np.array([0.0, 0.3, 1.0, 3.0, 10.0, 30.0]) * clearance
    through = np.array([
        float(blocked(make_plant, float(z), land_leakage_clearance=clearance).signals.supply_flow)
        for z in laps
    ])  # fmt: skip
    assert np.all(np.diff(through) < 0.0)
    mirrored = blocked(make_plant, -float(laps[3]), land_leakage_clearance=clearance)
    assert mirrored.signals.supply_flow == pytest.approx(through[3], rel=1e-6)
    # far out the closed lands carry the whole drop: 1/q is a straight line over z
    z, inverse = laps[3:], 1.0 / through[3:]
    slope, at_null = np.polyfit(z, inverse, 1)
    assert at_null / slope == pytest.approx(0.5 * clearance, rel=0.1)
    assert np.polyval((slope, at_null), z) == pytest.approx(inverse, rel=0.02)
    gap = 0.84 * SLOT * clearance
    # two lands, one from s to b and one from a to t
    foot = 2.0 * WIDTH * gap**3 * P_S / (12 * 46e-6 * RHO * SLOT * laps[-1])
    assert through[-1] == pytest.approx(foot, rel=0.05)


def test_land_leakage_falls_with_the_overlap_of_the_lands(make_plant: MakePlant) -> None:
    """Lands that overlap by ten clearances leak a twentieth of those that meet the ports' edges."""
    flows = [
        float(blocked(make_plant, 0.0, land_leakage_clearance=5e-5, overlap_lap=lap)
              .signals.supply_flow) for lap in (0.0, 5e-4)
    ]  # fmt: skip
    assert flows[1] / flows[0] == pytest.approx(1.0 / 21.0, rel=0.02)
