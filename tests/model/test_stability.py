"""The step that a configuration needs, and what holds for every configuration there is."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference_machine import STEP, machine

from hil_emulator.model.declare import Param
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Plant
from hil_emulator.model.quantities import PARAMS
from hil_emulator.model.stability import REACH, required_step, step_bound

PLANT = [e for e in CATALOGUE if e.stage.table != "sensors"]
LARGE = 1e3
"""What stands for an infinite bound, relative to the typical value."""


def test_the_reference_machine_needs_the_default_step(model: Kernel) -> None:
    """The fastest mode is the chamber at the stop behind a wide edge: beta K_v u/(v sqrt delta)."""
    fastest = 1.3e9 * 6.68e-6 * 0.01 / (3e-6 * math.sqrt(1e5))
    step = required_step(model, machine())
    assert step == pytest.approx(REACH / fastest, rel=0.02)
    assert step > STEP


def test_every_effect_at_typical_keeps_the_default_step(model: Kernel) -> None:
    """The whole catalogue on is no reason for a smaller step."""
    values = machine() | {e.field_of(e.knob): e.knob.typical for e in PLANT}
    assert required_step(model, values) > STEP


@pytest.mark.parametrize(
    "stiff",
    [
        {"valve_laminar_width": 1e3},
        {"cylinder_dead_volume_a": 1e-7},
        {"driver_lag_time_constant": 2e-6},
        {"supply_line_length": 5e-3},
        {"line_waves_length": 0.2},
    ],
    ids=lambda s: next(iter(s)),
)
def test_a_stiff_configuration_needs_less_and_gets_along_with_it(
    stiff: dict[str, float], model: Kernel
) -> None:
    """At the default step it goes wild; at the step that is named it agrees with a finer one."""
    values = machine(**stiff)
    step = required_step(model, values)
    assert step < 0.8 * STEP

    def run(width: float) -> float:
        plant = Plant(model, values, width)
        plant.inputs.valve_current = 8e-3
        plant.step(round(0.02 / width))
        return float(plant.signals.position)

    assert run(step) == pytest.approx(run(step / 4), rel=1e-3)


@pytest.mark.parametrize(
    ("stiff", "state"),
    [
        ({"valve_laminar_width": 1e3, "valve_slot_per_ampere": 1.0}, "pressure"),
        ({"cylinder_dead_volume_b": 1e-7}, "pressure_b"),
        ({"driver_lag_time_constant": 1e-6}, "driver_lag_coil_current"),
        ({"end_stops_stiffness": 1e11, "load_mass": 0.2}, "velocity"),
    ],
    ids=lambda s: next(iter(s)) if isinstance(s, dict) else s,
)
def test_the_bound_names_what_was_made_stiff(
    stiff: dict[str, float], state: str, model: Kernel
) -> None:
    """What was changed from a usual actuator is what is named, and the state that it drives."""
    bound = step_bound(model, machine(**stiff))
    assert bound.step == required_step(model, machine(**stiff))
    assert bound.parameter in stiff
    assert bound.state.startswith(state)


@pytest.mark.parametrize(("bore", "rod"), [(0.016, 0.010), (0.040, 0.028)])
def test_a_cylinder_without_configured_stops_needs_no_smaller_step(
    bore: float, rod: float, model: Kernel
) -> None:
    """Dead volume is what is left at the ends: beta K_v u/(V sqrt delta), whatever the area is."""
    values = machine(end_stops_stiffness=0.0, cylinder_piston_area=math.pi * bore**2 / 4,
                     cylinder_area_ratio=1 - (rod / bore) ** 2)  # fmt: skip
    fastest = 1.3e9 * 6.68e-6 * 0.01 / (3e-6 * math.sqrt(1e5))
    assert required_step(model, values) == pytest.approx(REACH / fastest, rel=0.02)


@pytest.mark.slow
def test_joints_of_a_leg_are_one_system(two_actuators: Kernel) -> None:
    """Both rods on their stops: K over the least eigenvalue of a double pendulum's mass matrix.

    In rods' terms, stretched out: (J_1 + J_2 + 2 h)/l², (J_2 + h)/l², J_2/l², h = L (m c)_2. The
    shank alone would swing at K l²/J_2, a third as fast.
    """
    stiffness, thigh, shank, length, moment = 1e10, 0.03, 0.002, 0.35, 0.02
    names = two_actuators.parameters.names or ()
    common = {name: value for name, value in machine().items() if name in names}
    common |= {"load_mass": 0.1, "end_stops_stiffness": stiffness, "end_stops_damping": 0.0}
    carrying = common | {"rotary_joint_inertia": thigh, "rotary_joint_mass_moment": 0.1,
                         "rotary_joint_link_length": length}  # fmt: skip
    carried = common | {"rotary_joint_inertia": shank, "rotary_joint_mass_moment": moment}
    # triangle of 0.322, 0.045 and 0.282 m: its height is the lever
    angle = math.acos((0.322**2 + 0.045**2 - 0.282**2) / (2.0 * 0.322 * 0.045))
    lever, h = 0.322 * 0.045 * math.sin(angle) / 0.282, length * moment
    mass = np.array([[thigh + shank + 2.0 * h, shank + h], [shank + h, shank]]) / lever**2
    least = np.linalg.eigvalsh(mass + 0.1 * np.eye(2)).min()
    bound = step_bound(two_actuators, carrying, carried)
    assert bound.step == pytest.approx(REACH / math.sqrt(stiffness / least), rel=0.01)
    assert (bound.place, bound.state) == (1, "velocity")
    assert required_step(two_actuators, carrying, carried) == bound.step
    alone = {**carrying, "rotary_joint_link_length": 0.0}
    assert required_step(two_actuators, alone, carried) > 1.4 * bound.step


def choice(param: Param) -> st.SearchStrategy[float]:
    """Draw a value from a parameter's whole allowed range, small ones as often as large ones."""
    scale = LARGE * max(abs(param.typical), 1e-30)
    low, high = max(param.low, -scale), min(param.high, scale)
    if low < 0.0:
        return st.floats(low, high)
    floor = max(low, 1e-6 * high)
    logarithm = st.floats(math.log(floor), math.log(high))
    return logarithm.map(lambda e: min(high, max(low, math.exp(e))))


def near(param: Param) -> st.SearchStrategy[float]:
    """Draw a value within a factor of three of the typical one."""
    factor = st.floats(-1.0, 1.0).map(lambda e: 3.0**e)
    return factor.map(lambda f: min(param.high, max(param.low, f * param.typical)))


@st.composite
def configurations(
    draw: st.DrawFn, value: Callable[[Param], st.SearchStrategy[float]]
) -> dict[str, float]:
    """Draw an actuator and the effects that act on it."""
    values = {f"{t}_{p.name}": draw(value(p)) for t, ps in PARAMS.items() for p in ps}
    values["initial_position"] = values["cylinder_stroke"] * draw(st.floats(0.0, 1.0))
    for effect in PLANT:
        if draw(st.booleans()):
            values |= {effect.field_of(p): draw(value(p)) for p in effect.params}
    return values


@settings(
    max_examples=12, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
@given(values=configurations(choice) | configurations(near), seed=st.integers(0, 2**31))
def test_no_configuration_leaves_physics(
    values: dict[str, float], seed: int, model: Kernel
) -> None:
    """Whatever is allowed, at the step it needs: finite, no tension in oil, no energy made.

    Losses in valve and leaks are never negative at any moment; what friction, end stops and the
    coupling have taken in since the start is never negative either, but for the work of the largest
    friction along the presliding distance: seals that bent under less friction give back more.
    """
    step = min(STEP, required_step(model, values))
    if "backlash_gap" in values or "coupling_compliance_compliance" in values:
        step /= 4  # the account below adds up samples: a ringing coupling needs enough of them
    plant = Plant(model, values, step)
    rng = np.random.default_rng(seed)
    force = values["cylinder_piston_area"] * values["supply_pressure"]
    friction = stop = passed = throughput = largest = 0.0
    # the weight of the load stretches it from the start
    coupling = 0.5 * abs(float(plant.signals.load_force * plant.state.stretch))
    alpha, piston = values["cylinder_area_ratio"], values["cylinder_piston_area"]
    trapped = piston * values.get("cushion_plunger_share", 0.0)
    for _ in range(20):
        plant.inputs.valve_current = rng.uniform(-0.02, 0.02)
        plant.inputs.external_force = rng.uniform(-1.0, 1.0) * force
        for _ in range(50):
            plant.step(1)
            s = plant.signals
            assert np.all(np.isfinite(plant.signal_vector))
            assert min(s.pressure_a, s.pressure_b, s.supply_pressure, s.tank_pressure) >= 0.0
            assert s.valve_loss >= -1e-9 * abs(s.supply_power)
            assert s.leakage_loss >= 0.0
            friction += s.friction_loss * step
            largest = max(largest, abs(s.friction_force))
            # oil that a cushion traps only keeps what it gets from piston and chamber
            oil = (
                s.cushion_pressure_a - s.pressure_a - alpha * (s.cushion_pressure_b - s.pressure_b)
            )
            stop -= (s.stop_force - trapped * oil) * s.velocity * step
            coupling += s.load_force * (s.velocity - s.load_velocity) * step
            passed += abs(s.load_force * (s.velocity - s.load_velocity)) * step
            throughput += step * (
                abs(s.friction_loss) + abs(s.stop_force * s.velocity) + abs(s.load_power)
            )
    bent = largest * values["friction_presliding_distance"]
    assert friction >= -1e-2 * throughput - bent
    assert stop >= -1e-2 * throughput
    assert coupling >= -5e-2 * (throughput + passed)
