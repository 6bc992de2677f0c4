"""The module generated from the declarations, compiled or not, stored under its digest."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from reference_machine import STEP, bare, machine

from hil_emulator.model import kernel
from hil_emulator.model.acting import build_acting
from hil_emulator.model.declare import DeclarationError, Param, Quantity, Stage, effect
from hil_emulator.model.effects import CATALOGUE, friction
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import friction as friction_stage
from hil_emulator.model.stages import metering
from hil_emulator.model.stages import set_point as set_point_stage
from hil_emulator.platform.paths import cache_folder


def everything() -> dict[str, float]:
    """Return the reference machine with every effect of the plant at its typical value."""
    knobs = {e.field_of(e.knob): e.knob.typical for e in CATALOGUE if e.stage.table != "sensors"}
    return machine() | knobs | {"oil_temperature": 333.15}


def test_compiled_and_interpreted_module_agree(model: kernel.Kernel) -> None:
    """The same text run as plain Python gives the same trajectory, with every effect on."""
    plain = kernel.build(compiled=False)
    plants = [Plant(k, everything(), STEP) for k in (model, plain)]
    for current in (2e-3, -5e-3):
        for plant in plants:
            plant.inputs.valve_current = current
            plant.inputs.transverse_force = 50.0
            plant.step(12)
    compiled, interpreted = (p.signal_vector for p in plants)
    assert interpreted == pytest.approx(compiled, rel=1e-9, abs=1e-12)


def test_compiled_and_interpreted_sensors_agree(model: kernel.Kernel) -> None:
    """So do the readings, with every transducer effect on."""
    chain = {e.field_of(e.knob): e.knob.typical for e in CATALOGUE if e.stage.table == "sensors"}
    chain |= {"measuring_range_upper": 1e9, "resolution_step": 1e-3}
    readings = []
    for k in (model, kernel.build(compiled=False)):
        plant = Plant(model, machine(), STEP)
        channels = {"load_force": chain, "velocity": chain}
        sensors = Sensors(k, channels, 1e-3, np.random.default_rng(1))
        plant.inputs.valve_current = 1e-3
        for _ in range(5):
            plant.step(50)
            sensors.sample(plant.signal_vector, plant.path)
        readings.append(sensors.reading.copy())
    assert readings[0] == pytest.approx(readings[1], rel=1e-9)


def test_a_kernel_may_divide_its_steps_another_way() -> None:
    """Where the rod hits its stop, steps in eight pieces are ten times as exact as whole ones."""

    def run(pieces: int, step: float) -> float:
        kernel_ = kernel.build(compiled=False, constants={"PIECES": pieces})
        plant = Plant(kernel_, machine(), step)
        plant.state.position, plant.state.velocity = plant.parameters.cylinder_stroke - 2e-3, 0.5
        plant.step(round(8e-3 / step))
        return float(plant.state.velocity)

    exact = run(8, 2e-5)
    assert abs(run(8, 2.5e-4) - exact) < 0.1 * abs(run(1, 2.5e-4) - exact)


def test_signals_belong_to_the_state_reached(make_plant: Callable[..., Plant]) -> None:
    """After a step the signals are those of the new state, not of a trial inside the step.

    The power of the entrained air is followed from where a call began, to the last digits.
    """
    plant = make_plant(machine())
    plant.inputs.valve_current = 3e-3
    plant.step(100)
    before = plant.signal_vector.copy()
    plant.step(0)
    np.testing.assert_allclose(plant.signal_vector, before, rtol=1e-13)
    assert plant.signals.position == plant.state.position


def test_one_call_of_many_steps_equals_many_calls_of_one(make_plant: Callable[..., Plant]) -> None:
    """With a constant set point, the grouping of steps into calls changes only the rounding.

    The power of the entrained air is followed from where a call began, to 4e-12.
    """
    once, often = make_plant(machine()), make_plant(machine())
    once.inputs.valve_current = often.inputs.valve_current = 2e-3
    once.step(200)
    for _ in range(200):
        often.step(1)
    assert once.signal_vector == pytest.approx(often.signal_vector, rel=1e-9, abs=1e-12)


def knob() -> Param:
    """Return some knob."""
    return Param("strength", "N", "how much", 1.0, 0.0, 10.0)


def test_a_law_with_an_unknown_argument_is_refused() -> None:
    """The message names the effect, the name, and what its stage offers."""

    @effect(friction_stage, knob=knob(), source="test", signature="test")
    def odd_friction(moon_phase: float, strength: float) -> float:
        """F = moon."""
        return moon_phase * strength

    with pytest.raises(DeclarationError, match=r"odd_friction.*moon_phase.*velocity"):
        kernel.build((*CATALOGUE, odd_friction), compiled=False)


TABLE = np.array([0.0, 0.1, 1.0]), np.array([0.0, 5.0, 100.0])
"""Velocities, and a force at each."""


@effect(friction_stage, knob=knob(), source="test", signature="test")
def measured_friction(velocity: float, strength: float) -> float:
    """F = f(v)."""
    return strength * math.copysign(np.interp(abs(velocity), *TABLE), velocity)


@pytest.mark.slow
def test_a_law_may_look_into_a_table() -> None:
    """Numba makes arrays of it; code for the active effects may contain such a law as well."""
    cache = cache_folder()
    kernel_ = kernel.build([measured_friction], cache)
    plants = []
    for tick in (kernel_.tick, build_acting(kernel_, [measured_friction], cache)):
        plant = Plant(kernel_, bare(measured_friction_strength=2.0), STEP)
        supply, path = plant.supply, np.zeros((4, len(CHANNELS)))
        plant.state.velocity = 0.55
        assert tick(
            supply.states, supply.past, supply.parameters, supply.inputs, supply.signals, path,
            STEP, 4,
        )  # fmt: skip
        plants.append(plant)
    assert plants[0].signals.friction_force == pytest.approx(2.0 * 52.5, rel=0.05)
    np.testing.assert_array_equal(plants[0].supply.states, plants[1].supply.states)


def test_an_effect_without_an_equation_is_refused() -> None:
    """The docstring is the documentation, so it must be there."""
    with pytest.raises(DeclarationError, match="docstring"):

        @effect(friction_stage, knob=knob(), source="test", signature="test")
        def silent(strength: float) -> float:
            return strength


def test_a_state_at_a_stage_that_is_called_four_times_is_refused() -> None:
    """Each of the four edges would overwrite it."""
    with pytest.raises(DeclarationError, match="several times"):

        @effect(metering, knob=knob(), source="test", signature="test",
                states=(Quantity("memory", "A", "something"),))  # fmt: skip
        def sticky(opening: float, memory: float, strength: float) -> tuple[float, float]:
            """U = u."""
            return opening, strength


def test_an_effect_declared_twice_is_refused() -> None:
    """Two effects of one name would share their memory."""
    twice = (*CATALOGUE, friction.coulomb_friction)
    with pytest.raises(DeclarationError, match="declared twice"):
        kernel.build(twice, compiled=False)


def test_an_effect_at_an_unknown_stage_is_refused() -> None:
    """It would never be called."""
    nowhere = Stage("nowhere", "load", ("position",), "nothing", "N", "sum", balances=())

    @effect(nowhere, knob=knob(), source="test", signature="test")
    def lost(strength: float) -> float:
        """F = 0."""
        return strength

    with pytest.raises(DeclarationError, match="no stage 'nowhere'"):
        kernel.build((*CATALOGUE, lost), compiled=False)


def test_a_name_that_numpy_records_use_is_refused() -> None:
    """A field called `size` could not be read back."""
    with pytest.raises(DeclarationError, match="size"):
        Param("size", "m", "how large", 1.0, 0.0, 2.0)


def test_a_user_effect_joins_the_catalogue() -> None:
    """A user's effect needs its declaration only."""

    @effect(friction_stage, knob=knob(), source="own measurement", signature="load cell")
    def own_friction(velocity: float, strength: float) -> float:
        """F = s v."""
        return strength * velocity

    built = kernel.build((*CATALOGUE, own_friction), compiled=False)
    plant = Plant(built, machine(own_friction_strength=100.0), STEP)
    plant.state.velocity = 0.1
    plant.step(0)
    assert plant.signals.friction_force == pytest.approx(1000 * 0.1 + 100.0 + 100.0 * 0.1)


def test_the_cache_folder_changes_with_every_source(tmp_path: Path) -> None:
    """Editing any file of the model, or a user's effect, gives another digest."""
    before = kernel.sources_digest(CATALOGUE)
    assert before == kernel.sources_digest(CATALOGUE)
    module = tmp_path / "own.py"
    space: dict[str, object] = {}
    text = "def law(strength):\n    '''F = s.'''\n    return strength\n"
    module.write_text(text)
    exec(compile(text, str(module), "exec"), space)
    declared = effect(friction_stage, knob=knob(), source="own", signature="own")(space["law"])
    with_own = kernel.sources_digest((*CATALOGUE, declared))
    module.write_text(text + "# edited\n")
    assert len({before, with_own, kernel.sources_digest((*CATALOGUE, declared))}) == 3


def test_the_module_is_kept_under_its_digest(tmp_path: Path) -> None:
    """The file written for the cache can be read and names its source."""
    kernel.build(cache=tmp_path)
    (file,) = tmp_path.rglob("hil_emulator_kernel_*.py")
    assert file.parent.name == kernel.sources_digest(CATALOGUE)
    assert "def friction(par, x, dx, velocity" in file.read_text()


def test_a_cache_that_cannot_be_written_does_no_harm(tmp_path: Path) -> None:
    """The model then compiles for this run alone."""
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert kernel.build(cache=blocked).effects == CATALOGUE


class Curve(NamedTuple):
    """Arguments that a friction law takes as one record."""

    velocity: float
    strength: float
    load_mass: float


def test_a_law_may_take_a_record_of_what_belongs_together() -> None:
    """Each field has the value that an argument of that name would have."""

    @effect(friction_stage, knob=knob(), source="own measurement", signature="load cell")
    def curved_friction(given: Curve) -> float:
        """F = s v m."""
        return given.strength * given.velocity * given.load_mass

    built = kernel.build((*CATALOGUE, curved_friction), compiled=False)
    values = machine(curved_friction_strength=2.0)
    plant = Plant(built, values, STEP)
    plant.state.velocity = 0.1
    plant.step(0)
    force = 2.0 * 0.1 * values["load_mass"]
    assert plant.signals.friction_force == pytest.approx(1000 * 0.1 + 100.0 + force)


def test_what_changes_a_set_point_does_so_before_it_is_late() -> None:
    """A user's law acts on both set points of a tick in which one arrives."""

    @effect(set_point_stage, knob=knob(), source="test", signature="test")
    def doubling(set_point: float, strength: float) -> float:
        """U = (1 + k) u."""
        return (1.0 + strength) * set_point

    lag = 20.0 * STEP
    values = machine(transport_delay_time=5.5 * STEP, doubling_strength=1.0,
                     driver_lag_time_constant=lag)  # fmt: skip
    plant = Plant(kernel.build((*CATALOGUE, doubling), compiled=False), values, STEP)
    for current in (1e-3, 2e-3):
        plant.inputs.valve_current = current
        plant.step(10)
    reached = 0.0
    for target, steps in ((2e-3, 15.5), (4e-3, 4.5)):
        reached = target + (reached - target) * np.exp(-steps * STEP / lag)
    assert plant.signals.valve_current == pytest.approx(reached, rel=1e-6)
