"""The linear model against its document, and against the exact linearisation of the model."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.model import actuator, linear, linearise
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.kernel import Kernel, build
from hil_emulator.model.plant import Plant

POSITIONS = (0.005, 0.02, 0.04, 0.06, 0.075)
OPENINGS = (-2e-3, 1e-3, 5e-3)

# The machine of the document's root locus: 16/10/80 mm, 160 bar, 1300 MPa, 50 kg, no dry friction,
# zero lap, turbulent edges, no air, tank at vacuum as S1 has it.
MACHINE = {
    f"{table}_{p.name}": p.typical for table, params in actuator.PARAMS.items() for p in params
} | {
    "tank_pressure": 0.0,
    "valve_critical_reynolds_number": 0.0,
    "viscous_friction_coefficient": 1000.0,
    "load_viscous_friction_coefficient": 500.0,
}


@pytest.fixture(scope="module")
def kernel() -> Kernel:
    """Return the model as plain Python: a few hundred evaluations need no compiler."""
    return build(compiled=False)


def nearest(poles: np.ndarray, wanted: complex) -> complex:
    """Return the pole nearest to a wanted one."""
    return complex(poles[np.argmin(np.abs(poles - wanted))])


def point_of(linearisation: linearise.Linearisation) -> linear.OperatingPoint:
    """Return the operating point of the analytic forms at an equilibrium found."""
    at = linearisation.signals
    return linear.OperatingPoint(
        at["spool_position"], at["position"], at["pressure_a"], at["pressure_b"]
    )


@pytest.mark.parametrize(("current", "bar_a", "bar_b"), [(1e-3, 29.5, 48.5), (-1e-3, 79.5, 130.5)])
def test_no_load_pressures_are_those_of_the_area_ratio(
    kernel: Kernel, current: float, bar_a: float, bar_b: float
) -> None:
    """An unloaded rod moves at alpha³, alpha² (or alpha, 1) times p_s/(1 + alpha³), 160 bar."""
    free = MACHINE | {"viscous_friction_coefficient": 0.0, "load_viscous_friction_coefficient": 0.0}
    closed_form = linear.operating_point(linear.LinearisedMachine.of(free), current, 0.04)
    assert (closed_form.pressure_a, closed_form.pressure_b) == pytest.approx(
        (bar_a * 1e5, bar_b * 1e5), rel=5e-3
    )
    signals = linearise.steady_motion(kernel, free, current, 0.04).signals
    assert signals["pressure_a"] == pytest.approx(closed_form.pressure_a, rel=5e-3)
    assert signals["pressure_b"] == pytest.approx(closed_form.pressure_b, rel=5e-3)


@pytest.mark.slow
def test_a_simulated_stroke_settles_at_the_equilibrium_found(kernel: Kernel) -> None:
    """Newton's equilibrium is the one that the model reaches under a constant current."""
    light = MACHINE | {"load_mass": 5.0, "initial_position": 0.02}
    plant = Plant(kernel, light, 1e-4)
    plant.inputs.valve_current = 2e-3
    plant.step(1500)
    equilibrium = linearise.steady_motion(kernel, light, 2e-3, 0.05).equilibrium
    for name in ("pressure_a", "pressure_b", "velocity"):
        assert plant.state[name] == pytest.approx(equilibrium[name], rel=1e-4)


@pytest.mark.parametrize("position", POSITIONS)
@pytest.mark.parametrize("current", OPENINGS)
def test_reduced_poles_are_exact_where_both_pressures_share_one_mode(
    kernel: Kernel, position: float, current: float
) -> None:
    """With v_a = alpha v_b, S1 eq. 3.29-3.32 hold in motion: the printed poles within 1 %."""
    machine = linear.LinearisedMachine.of(MACHINE)
    v_a, v_b = machine.volumes(position)
    bigger = max(v_a, machine.ratio * v_b)
    values = MACHINE | {
        "cylinder_dead_volume_a": machine.dead_volume_a + bigger - v_a,
        "cylinder_dead_volume_b": machine.dead_volume_b + bigger / machine.ratio - v_b,
    }
    model = linearise.steady_motion(kernel, values, current, position)
    response = linear.reduced(linear.LinearisedMachine.of(values), point_of(model))
    for pole in response.hydraulic_force.poles:
        assert abs(nearest(model.poles, pole) - pole) < 0.01 * abs(pole)


@pytest.mark.parametrize("position", POSITIONS)
@pytest.mark.parametrize("current", OPENINGS)
def test_complete_poles_are_exact_everywhere(
    kernel: Kernel, position: float, current: float
) -> None:
    """With both pressures free every pole but the position's own is met within 1 %."""
    model = linearise.steady_motion(kernel, MACHINE, current, position)
    poles = linear.complete(linear.LinearisedMachine.of(MACHINE), point_of(model)).load_force.poles
    assert abs(model.poles[0]) < 1e-6
    assert len(poles) == len(model.poles) - 1
    for pole in poles:
        assert abs(nearest(model.poles, pole) - pole) < 0.01 * abs(pole)


@pytest.mark.parametrize(
    ("lap", "printed", "real"), [(28e-6, -19.3, -19.5), (280e-6, -57.9, -60.3)]
)
def test_reduced_poles_err_by_the_tied_pressures(
    kernel: Kernel, lap: float, printed: float, real: float
) -> None:
    """With null leakage at mid-stroke, eq. 3.29-3.32 cost 1 % and 4 % of the damping."""
    values = MACHINE | {"underlap_lap": lap}
    machine = linear.LinearisedMachine.of(values)
    pole = linear.reduced(machine, linear.operating_point(machine, 0.0, 0.04)).load_force.poles
    assert nearest(pole, -40 + 380j).real == pytest.approx(printed, rel=5e-3)
    model = linearise.rest(kernel, values, 0.04)
    assert nearest(model.poles, -40 + 380j).real == pytest.approx(real, rel=1e-2)


@pytest.mark.parametrize(
    ("position", "hertz"), [(0.005, 86.0), (0.02, 69.0), (0.04, 60.5), (0.075, 65.0)]
)
def test_resonance_follows_the_oil_columns(kernel: Kernel, position: float, hertz: float) -> None:
    """A closed valve leaves 50 kg on A_p² beta (1/v_a + alpha²/v_b)."""
    model = linearise.rest(kernel, MACHINE, position)
    machine = linear.LinearisedMachine.of(MACHINE)
    k = linear.force_coefficients(machine, linear.operating_point(machine, 0.0, position))
    stiffness = math.sqrt(-k.k_xp / machine.mass)
    pole = nearest(model.poles, 1j * stiffness)
    assert abs(pole) / 2 / math.pi == pytest.approx(hertz, rel=0.01)
    assert abs(pole) == pytest.approx(stiffness, rel=1e-3)


@pytest.mark.parametrize(("output", "zero"), [("hydraulic_force", -30.0), ("load_force", -10.0)])
def test_zeros_are_the_load_alone(kernel: Kernel, output: str, zero: float) -> None:
    """The rod force vanishes where load (and piston) move freely: S1 Fig. 3.14, within 1 %."""
    machine = linear.LinearisedMachine.of(MACHINE)
    for current in OPENINGS:
        model = linearise.steady_motion(kernel, MACHINE, current, 0.04)
        assert nearest(model.zeros("valve_current", output), zero) == pytest.approx(zero, rel=0.01)
        for form in (linear.reduced, linear.complete):
            response = getattr(form(machine, point_of(model)), output)
            assert nearest(response.zeros, zero) == pytest.approx(zero, rel=0.01)


def test_the_printed_sign_of_k_fh_is_unstable() -> None:
    """At 5 mA S1 eq. 3.37 as printed puts poles at +322 ± j143; corrected, -352 ± j202."""
    machine = linear.LinearisedMachine.of(MACHINE)
    point = linear.operating_point(machine, 5e-3, 0.04)
    k = linear.force_coefficients(machine, point)
    assert k.k_fh < 0.0
    assert k.k_xp < 0.0
    printed = np.roots(np.polyadd(np.polymul([1.0, k.k_fh], [machine.mass, 1500.0]), [-k.k_xp]))
    assert printed[0].real == pytest.approx(322.0, rel=0.01)
    poles = linear.reduced(machine, point).load_force.poles
    assert nearest(poles, -352 + 202j) == pytest.approx(-352 + 202j, rel=0.01)


@pytest.mark.parametrize("current", [2e-3, -2e-3])
def test_pressure_sensitivity_is_twice_the_drop_over_the_opening(current: float) -> None:
    """S1 eq. 3.27 and 3.28 lose their K_v: K_pa = 2 dp_a/u_v, and K_pb is negative."""
    machine = linear.LinearisedMachine.of(MACHINE)
    point = linear.operating_point(machine, current, 0.04)
    drop_a = 160e5 - point.pressure_a if current > 0 else point.pressure_a
    drop_b = point.pressure_b if current > 0 else 160e5 - point.pressure_b
    c = linear.valve_coefficients(machine, point)
    assert c.k_pa == pytest.approx(2.0 * drop_a / abs(current))
    assert c.k_pb == pytest.approx(-2.0 * drop_b / abs(current))
    assert c.k_ca > 0.0 > c.k_cb


def test_null_sensitivity_is_supply_over_underlap() -> None:
    """28 uA of underlap give the 5.7e11 Pa/A of S1 3.5.1 at 160 bar."""
    machine = linear.LinearisedMachine.of(MACHINE | {"underlap_lap": 28e-6})
    c = linear.valve_coefficients(machine, linear.OperatingPoint(0.0, 0.04, 80e5, 80e5))
    assert c.k_pa == pytest.approx(160e5 / 28e-6)
    assert c.k_pa == pytest.approx(5.7e11, rel=5e-3)
    assert c.k_pb == pytest.approx(-c.k_pa)


def test_valve_coefficients_are_the_slopes_of_the_compiled_flow(kernel: Kernel) -> None:
    """q_a and q_b of the model change with current and pressure by K_q and K_c."""
    values = MACHINE | {"underlap_lap": 28e-6}
    machine = linear.LinearisedMachine.of(values)
    model = linearise.steady_motion(kernel, values, 1e-3, 0.04, outputs=("flow_a", "flow_b"))
    c = linear.valve_coefficients(machine, point_of(model))
    column = {name: model.c[:, i] for i, name in enumerate(model.states)}
    assert column["spool_position"] == pytest.approx([c.k_qa, c.k_qb], rel=1e-3)
    assert column["pressure_a"] == pytest.approx([-c.k_ca, 0.0], rel=2e-3)
    assert column["pressure_b"] == pytest.approx([0.0, -c.k_cb], rel=2e-3)


def test_static_gain_is_the_document_s() -> None:
    """At zero frequency f_h/u = K_uv D/(-K_fh D - K_xp) with D = B + B_l."""
    machine = linear.LinearisedMachine.of(MACHINE)
    point = linear.operating_point(machine, 1e-3, 0.04)
    k = linear.force_coefficients(machine, point)
    expected = k.k_uv * 1500.0 / (-k.k_fh * 1500.0 - k.k_xp)
    for form in (linear.reduced, linear.complete):
        _, value = form(machine, point).hydraulic_force.freqresp([1e-3])
        assert abs(value[0]) == pytest.approx(expected, rel=2e-2)


def test_transfer_function_has_the_response_of_its_state_space(kernel: Kernel) -> None:
    """Poles, zeros and gain carry the same frequency response as A, B, C, D."""
    omega = np.geomspace(0.3, 3000.0, 20)
    model = linearise.steady_motion(kernel, MACHINE | {"underlap_lap": 28e-6}, 1e-3, 0.03)
    for output in ("hydraulic_force", "load_force", "velocity"):
        _, value = linear.exact(model, output).freqresp(omega)
        assert value == pytest.approx(model.response("valve_current", output, omega), rel=1e-6)


def test_states_of_effects_that_are_off_are_left_out(kernel: Kernel) -> None:
    """The bare machine has the six states of its balances."""
    model = linearise.rest(kernel, MACHINE, 0.04)
    assert model.states == tuple(q.name for q in actuator.STATES)


def test_an_effect_that_is_on_brings_its_own_pole(kernel: Kernel) -> None:
    """A driver lag of 0.2 ms is a pole at -5000 rad/s and leaves the others where they were."""
    bare = linearise.rest(kernel, MACHINE, 0.04)
    model = linearise.rest(kernel, MACHINE | {"driver_lag_time_constant": 2e-4}, 0.04)
    assert set(model.states) - set(bare.states) == {"driver_lag_coil_current"}
    assert nearest(model.poles, -5000.0) == pytest.approx(-5000.0)
    assert nearest(model.poles, 380j) == pytest.approx(nearest(bare.poles, 380j), rel=1e-6)


def test_bristles_are_a_spring_at_rest_and_a_force_in_motion(kernel: Kernel) -> None:
    """Seals hold the rod at sqrt((k_h + F_c/d)/M); in motion they are bent to 3 d.

    The transition velocity is wide here: it damps the spring by F_c/v_t.
    """
    values = MACHINE | {
        "coulomb_friction_force": 100.0, "friction_presliding_distance": 5e-5,
        "friction_transition_velocity": 0.1,
    }  # fmt: skip
    machine = linear.LinearisedMachine.of(MACHINE)
    k = linear.force_coefficients(machine, linear.operating_point(machine, 0.0, 0.04))
    stuck = math.sqrt((2e6 - k.k_xp) / machine.mass)
    model = linearise.rest(kernel, values, 0.04)
    assert abs(nearest(model.poles, 1j * stuck)) == pytest.approx(stuck, rel=0.01)
    moving = linearise.steady_motion(kernel, values, 1e-3, 0.04)
    assert moving.equilibrium["seal_bend"] == pytest.approx(3.0, rel=1e-6)


def test_soft_oil_is_no_obstacle_to_finding_the_motion(kernel: Kernel) -> None:
    """With 0.5 % of air the steady pressures are those of stiff oil: nothing is compressed."""
    stiff = linearise.steady_motion(kernel, MACHINE, 1e-3, 0.04).signals
    soft = linearise.steady_motion(kernel, MACHINE | {"entrained_air_fraction": 5e-3}, 1e-3, 0.04)
    for name in ("pressure_a", "pressure_b", "velocity"):
        assert soft.signals[name] == pytest.approx(stiff[name], rel=1e-4)


def test_play_cuts_the_load_off_at_rest(kernel: Kernel) -> None:
    """Inside a backlash no current reaches the load: there is no transfer function to give."""
    model = linearise.rest(kernel, MACHINE | {"backlash_gap": 1e-4}, 0.04)
    with pytest.raises(ValueError, match="does not reach"):
        linear.exact(model, "load_force")


def test_an_impossible_rest_is_refused(kernel: Kernel) -> None:
    """160 bar on 2 cm² cannot hold 5 kN through a leaking valve."""
    with pytest.raises(NoEquilibriumError):
        linearise.rest(kernel, MACHINE | {"underlap_lap": 28e-6, "gravity_force": 5e3}, 0.04)
    machine = linear.LinearisedMachine.of(MACHINE)
    beyond = replace(linear.operating_point(machine, 0.0, 0.04), pressure_a=161e5)
    with pytest.raises(ValueError, match="between tank and supply"):
        linear.valve_coefficients(machine, beyond)
