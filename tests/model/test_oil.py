"""The physics of the oil's effects: stiffness, vapour, viscosity."""

import math
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal, getcontext

import numpy as np
import pytest
from experiment import lock, record, settle
from hypothesis import given
from hypothesis import strategies as st
from reference_machine import bare, machine

from hil_emulator.model.constants import GAS_REACH, GAS_STRIDE
from hil_emulator.model.effects.cylinder import end_stops
from hil_emulator.model.effects.friction import viscous_friction
from hil_emulator.model.effects.oil import cavitation_floor, entrained_air
from hil_emulator.model.gas import approach
from hil_emulator.model.kernel import build
from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
AREA, ALPHA, BETA = 2.0106e-4, 0.61, 1.3e9


def stiffness(plant: Plant) -> float:
    """Measure the static stiffness of the rod between shut chambers [N/m] by 1 N."""
    before = float(plant.state.position)
    plant.inputs.external_force = plant.signals.hydraulic_force - 1.0
    settle(plant, 0.5)
    return 1.0 / (float(plant.state.position) - before)


def expected_stiffness(beta: float) -> float:
    """A² beta (1/v_a + alpha²/v_b) at mid-stroke."""
    v_a, v_b = 3e-6 + AREA * 0.04, 3e-6 + ALPHA * AREA * 0.04
    return AREA**2 * beta * (1 / v_a + ALPHA**2 / v_b)


def mixture(
    pressure: float, fraction: float, exponent: float = 1.4, held: float = 1e5
) -> float:  # fmt: skip
    """Return E' at a pressure, in a call of the integrator that began at another one."""
    reference, stride = (101_325.0 / held) ** (1.0 / exponent), GAS_STRIDE ** (-1.0 / exponent)
    change, expansion = approach(pressure / held, reference, stride)
    return float(entrained_air(BETA, pressure, change, expansion, fraction, exponent))


DAMPED = {"viscous_friction_coefficient": 1e4}


def test_modulus_pressure_stiffens_each_chamber_with_its_pressure(make_plant: MakePlant) -> None:
    """Each chamber's spring follows E + m p at its own pressure."""
    plant = make_plant(bare(**DAMPED, modulus_pressure_rise=10.0))
    p_a, p_b = plant.signals.pressure_a, plant.signals.pressure_b
    v_a, v_b = 3e-6 + AREA * 0.04, 3e-6 + ALPHA * AREA * 0.04
    expected = AREA**2 * ((BETA + 10 * p_a) / v_a + ALPHA**2 * (BETA + 10 * p_b) / v_b)
    assert stiffness(plant) == pytest.approx(expected, rel=1e-3)


def test_modulus_temperature_is_neutral_at_the_reference(make_plant: MakePlant) -> None:
    """The rod's spring softens by n per kelvin above 40 °C."""
    stiffnesses = [
        stiffness(
            make_plant(
                bare(**DAMPED, modulus_temperature_fall=0.004, oil_temperature=273.15 + celsius)
            )
        )
        for celsius in (40.0, 60.0)
    ]
    assert stiffnesses[0] == pytest.approx(expected_stiffness(BETA), rel=1e-3)
    assert stiffnesses[1] == pytest.approx(expected_stiffness(BETA * (1 - 0.004 * 20)), rel=1e-3)


def test_line_compliance_is_a_spring_in_series(make_plant: MakePlant) -> None:
    """C/V adds to 1/beta, so a hose acts like dead volume: as C beta more of it."""
    compliance = 2e-15
    measured = stiffness(make_plant(bare(**DAMPED, line_compliance_compliance=compliance)))
    more = compliance * BETA
    same = bare(**DAMPED, cylinder_dead_volume_a=3e-6 + more, cylinder_dead_volume_b=3e-6 + more)
    assert measured == pytest.approx(stiffness(make_plant(same)), rel=1e-6)


@pytest.mark.parametrize("fraction", [1e-6, 0.005, 0.2])
def test_entrained_air_is_the_derivative_of_the_mixtures_volume(fraction: float) -> None:
    """E' = -V dp/dV, by differences in 50 digits, of oil with constant modulus and its gas."""
    getcontext().prec = 50
    r, k, p_0, modulus, step = map(Decimal, (str(fraction), "1.4", "101325", "1.3e9", "1e-12"))

    def volume(q: Decimal) -> Decimal:
        return (-q / modulus).exp() + r * ((p_0 / q).ln() / k).exp()

    for p in np.geomspace(1e2, 400e5, 30):
        q = Decimal(float(p))
        exact = -volume(q) * 2 * step * q / (volume(q * (1 + step)) - volume(q * (1 - step)))
        assert mixture(float(p), fraction) == pytest.approx(float(exact), rel=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 1.1, 1.3, 1.4])
@pytest.mark.parametrize("held", [0.7e5, 30e5, 300e5])
def test_entrained_air_is_the_exact_power_of_any_pressure(held: float, exponent: float) -> None:
    """Near the pressure at which a call began and far from it, E' is within 1e-11 of 50 digits.

    The oil's own modulus is at least three times the pressure.
    """
    getcontext().prec = 50
    r, k, p_0, modulus = map(Decimal, ("0.1", str(exponent), "101325", "1.3e9"))
    for p in np.append(np.geomspace(0.7, 1.4, 41) * held, [1e-3 * held, min(1e3 * held, BETA / 3)]):
        q = Decimal(float(p))
        gas = r * ((p_0 / q).ln() / k + q / modulus).exp()
        exact = modulus * (1 + gas) / (1 + gas * modulus / (k * q))
        assert mixture(float(p), 0.1, exponent, held) == pytest.approx(float(exact), rel=1e-11)


@pytest.mark.parametrize("ratio", [0.0, 1e-300, 1e300, math.inf, math.nan])
def test_gas_is_followed_to_any_pressure_in_the_end(ratio: float) -> None:
    """Pressures as a lost state has them are no reason to stay, near or not."""
    change, _ = approach(ratio, 1.0, 0.8)
    assert (abs(change) <= GAS_REACH) == (0.0 < ratio < math.inf)


def _exact_air(
    bulk_modulus: float, pressure: float, fraction: float, polytropic_exponent: float
) -> float:
    expansion = math.log(101_325.0 / pressure) / polytropic_exponent
    gas = fraction * math.exp(expansion + pressure / bulk_modulus)
    return (
        bulk_modulus * (1.0 + gas) / (1.0 + gas * bulk_modulus / (polytropic_exponent * pressure))
    )


@pytest.mark.slow
def test_entrained_air_moves_the_machine_as_its_exact_power_does() -> None:
    """After 2 s every state is within 1e-9 of its range of a machine with the power itself."""
    values = bare(
        entrained_air_fraction=0.02, entrained_air_polytropic_exponent=1.2,
        viscous_friction_coefficient=1000.0, end_stops_stiffness=1e8,
    )  # fmt: skip
    reached = []
    for air in (entrained_air, replace(entrained_air, law=_exact_air)):
        plant = Plant(build([air, viscous_friction, end_stops]), values, 20e-6)
        for i in range(2000):
            plant.inputs.valve_current = 2e-3 * math.sin(0.02 * i) + 1e-3 * math.sin(0.17 * i)
            plant.step(50)
        state = plant.state
        reached.append([state.pressure_a, state.pressure_b, state.position, state.velocity])
    ranges = [160e5, 160e5, 0.08, 1.0]
    assert np.max(np.abs(np.subtract(*reached)) / ranges) < 1e-9


def test_entrained_air_in_a_broken_state_is_reported_and_raises_nothing(
    make_plant: MakePlant,
) -> None:
    """A pressure that is no number leaves a tick as "not finite"."""
    plant = make_plant(bare(entrained_air_fraction=0.02))
    plant.state.pressure_a = math.nan
    assert not plant.step(4)


def test_entrained_air_is_compressed_to_the_volume_that_is_left(make_plant: MakePlant) -> None:
    """What fills a locked chamber from 2 to 150 bar is what V(p) of its contents gave way."""
    plant = make_plant(bare(entrained_air_fraction=0.02, load_mass=1e5))
    plant.set_pressures(2e5, 2e5)
    plant.inputs.valve_current = 2e-4
    pressure, volume, filled = [2e5], float(plant.signals.volume_a), 0.0
    while pressure[-1] < 150e5:
        before = float(plant.signals.flow_a)
        lock(plant, 1e-4, 1e-4)
        filled += 0.5e-4 * (before + float(plant.signals.flow_a))
        pressure.append(float(plant.signals.pressure_a))

    def specific(p: float) -> float:
        return math.exp(-p / BETA) + 0.02 * (101_325.0 / p) ** (1 / 1.4)

    # each volume that comes in is one of the density there: the logarithm of it grows
    compressed = volume * math.log(specific(2e5) / specific(pressure[-1]))
    assert filled == pytest.approx(compressed, rel=1e-3)


def test_entrained_air_tends_to_oil_and_to_gas() -> None:
    """High pressure leaves the oil's modulus, vacuum leaves k p; little air leaves oil at once."""
    assert mixture(1e9, 0.005) == pytest.approx(BETA, rel=5e-3)
    assert mixture(10.0, 0.2) == pytest.approx(14.0, rel=0.01)
    assert mixture(1e5, 1e-12) == pytest.approx(BETA, rel=1e-6)


def test_entrained_air_gives_the_same_volume_after_an_excursion(make_plant: MakePlant) -> None:
    """A rod pulled out against shut ports and let go returns: no gas is made or lost."""
    values = bare(entrained_air_fraction=0.002, viscous_friction_coefficient=1e4)
    plant = make_plant(values)
    start = float(plant.signals.position), float(plant.signals.pressure_a)
    plant.inputs.external_force = -5000.0
    settle(plant, 0.2)
    assert plant.signals.pressure_a < 1e5
    plant.inputs.external_force = 0.0
    settle(plant, 1.0)
    assert plant.signals.position == pytest.approx(start[0], abs=1e-7)
    assert plant.signals.pressure_a == pytest.approx(start[1], rel=2e-3)


def test_cavitation_floor_is_flat_and_fills_before_pressure_returns(make_plant: MakePlant) -> None:
    """Pulled out with shut ports, pressure rests at the floor; it rises where it fell."""
    plant = make_plant(bare(cavitation_floor_pressure_floor=0.6e5, load_mass=1.0,
                            viscous_friction_coefficient=2e4))  # fmt: skip
    recorded = []
    for force, ticks in ((-6000.0, 200), (0.0, 400)):
        plant.inputs.external_force = force
        pressure, position = record(plant, ticks * 50, "pressure_a", "position")
        recorded.append((pressure, position))
    (falling, out), (rising, back) = recorded
    assert falling.min() == 0.6e5
    assert np.count_nonzero(falling == 0.6e5) > 100
    fell = out[np.argmax(falling == 0.6e5)]
    returned = back[np.argmax(rising > 0.6e5)]
    assert out.max() - fell > 1e-4
    assert returned == pytest.approx(fell, abs=0.05 * (out.max() - fell))


def test_released_air_fills_the_missing_volume_until_the_oil_boils(make_plant: MakePlant) -> None:
    """Henry's law: b (p_g/p - 1) = (p_g - p_c)/E, p_c continued below p_g; then vapour pressure."""
    b, released, boiling = 0.004, 0.6e5, 0.1e5
    separate = {"cavitation_floor_pressure_floor": released,
                "cavitation_floor_vapour_pressure": boiling}  # fmt: skip
    plant = make_plant(bare(load_mass=1.0, viscous_friction_coefficient=2e4, **separate,
                            cavitation_floor_dissolved_air=b))  # fmt: skip
    between = []
    plant.inputs.external_force = -6000.0
    for _ in range(200):
        settle(plant, 1e-3)
        p, continued = float(plant.signals.pressure_a), float(plant.state.pressure_a)
        if boiling < p < released:
            between.append(p)
            assert b * (released / p - 1.0) == pytest.approx((released - continued) / BETA)
    assert len(between) > 5
    assert p == boiling


@given(pressure=st.floats(-1e9, 1e8), floor=st.floats(0.0, 1e5))
def test_one_pressure_is_the_default_of_cavitation(pressure: float, floor: float) -> None:
    """Release of air and boiling at one pressure: p = max(p, p_v), bit for bit."""
    defaults = [p.default for p in cavitation_floor.shape]
    assert cavitation_floor(max(0.0, pressure), pressure, floor, *defaults, BETA) == max(
        0.0, pressure, floor
    )


def test_viscosity_temperature_passes_the_points_of_the_grade(make_plant: MakePlant) -> None:
    """ISO VG 46 with a viscosity index of 100: 46 mm²/s at 40 °C, 6.8 mm²/s at 100 °C."""
    viscosities = {}
    for celsius in (20.0, 40.0, 100.0):
        plant = make_plant(bare(viscosity_temperature_slope=3.68, oil_temperature=273.15 + celsius))
        viscosities[celsius] = float(plant.signals.viscosity) * 1e6
    assert viscosities[40.0] == pytest.approx(46.0, rel=1e-12)
    assert viscosities[100.0] == pytest.approx(6.8, rel=0.01)
    assert 110.0 < viscosities[20.0] < 150.0


def test_viscosity_temperature_moves_friction_damping_and_leakage(make_plant: MakePlant) -> None:
    """From 20 to 60 °C friction falls and leakage grows by the ratio of viscosities."""
    nu, friction, leakage, decay = [], [], [], []
    for celsius in (20.0, 60.0):
        plant = make_plant(
            machine(
                coulomb_friction_force=0.0, internal_leakage_conductance=1.7e-13,
                viscosity_temperature_slope=3.68, oil_temperature=273.15 + celsius,
                entrained_air_fraction=0.0, load_viscous_friction_coefficient=0.0,
            )
        )  # fmt: skip
        plant.state.velocity = 1e-2
        settle(plant, 0.0)
        nu.append(float(plant.signals.viscosity))
        friction.append(float(plant.signals.friction_force) / 1e-2)
        leakage.append(float(plant.signals.leakage_flow))
        (speed,) = record(plant, 10_000, "velocity")
        decay.append(float(np.abs(speed[5000:]).max() / np.abs(speed[:2500]).max()))
    ratio = nu[0] / nu[1]
    assert ratio > 4.0
    assert friction[0] / friction[1] == pytest.approx(ratio, rel=1e-6)
    assert leakage[1] / leakage[0] == pytest.approx(ratio, rel=1e-6)
    assert decay[0] < 0.5 * decay[1]


def test_viscosity_temperature_widens_the_laminar_range(make_plant: MakePlant) -> None:
    """An orifice turns laminar at a drop that grows as viscosity squared."""
    flows = []
    for celsius in (40.0, 0.0):
        plant = make_plant(
            bare(
                viscosity_temperature_slope=3.68, oil_temperature=273.15 + celsius,
                load_mass=1e5, initial_position=0.08,
            )
        )  # fmt: skip
        plant.inputs.valve_current = 1e-3
        lock(plant, 0.3)
        flows.append((float(plant.signals.viscosity), float(plant.signals.pressure_a)))
    (warm, near), (cold, far) = flows
    assert cold > 3 * warm
    assert 160e5 - far > 160e5 - near
