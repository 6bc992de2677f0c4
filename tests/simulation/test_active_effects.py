"""Effects in a run's model: those that are on, and those that a fault can switch on."""

import dataclasses

import numpy as np
import pytest
from rigs import reference

from hil_emulator.config.load import Configuration
from hil_emulator.faults.plant import KINDS, PlantFaultKind
from hil_emulator.model import kernel
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.platform.paths import cache_folder
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import compiled


def driven(config: Configuration, changes: dict[str, float]) -> np.ndarray:
    """Return signals and readings of a motion of 300 ms, with parameters changed halfway."""
    model = compiled(config.effects, cache_folder())
    plant = Plant(model, config.plant, config.step)
    sensors = Sensors(model, config.sensors, 1e-3, np.random.default_rng(config.seed))
    rows = []
    for k in range(300):
        plant.inputs.valve_current = 8e-3 if k < 120 else -3e-3
        if k == 150:
            for name, value in changes.items():
                plant.parameters[name] = value
        plant.step(config.steps)
        sensors.sample(plant.signal_vector, plant.path)
        rows.append(np.concatenate([plant.signal_vector, sensors.reading, sensors.overrange]))
    return np.array(rows)


def test_effects_that_are_left_out_do_not_change_the_result() -> None:
    """Signals and readings are bit-identical to the whole catalogue, also with faults."""
    config = reference()
    lean = acting(config)
    assert len(lean.effects) < len(config.effects) / 2
    faulty = {"internal_leakage_conductance": 2e-12, "spool_rate_limit_rate": 0.05}
    assert np.array_equal(driven(lean, faulty), driven(config, faulty))


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.name)
def test_a_fault_finds_its_parameter_where_nothing_is_on(kind: PlantFaultKind) -> None:
    """Every plant fault can begin in a machine whose effects are all off."""
    config = reference()
    knobs = {e.field_of(e.knob): e.off for e in config.effects}
    off = {name: knobs.get(name, value) for name, value in config.plant.items()}
    lean = acting(dataclasses.replace(config, plant=off, sensors={}))
    assert kind.parameter in (kernel.layouts(lean.effects)["parameters"].names or ())


def test_an_effect_that_is_off_in_all_channels_is_left_out_with_its_shape() -> None:
    """A creep in one channel is kept; a lag of zero is left out, with its value."""
    config = reference()
    sensors = {**config.sensors}
    sensors["position"] = config.sensors["position"] | {"lag_time_constant": 0.0}
    sensors["load_force"] = config.sensors["load_force"] | {
        "creep_relative": 0.01,
        "creep_time_constant": 30.0,
    }
    lean = acting(dataclasses.replace(config, sensors=sensors))
    names = [e.name for e in lean.effects]
    assert "creep" in names
    assert "lag" not in names
    assert lean.sensors["load_force"] == sensors["load_force"]
    assert lean.sensors["position"] == config.sensors["position"]


def test_sensors_without_any_effect_read_the_signal() -> None:
    """Ideal channels report the measured quantity, and are within their range."""
    config = reference()
    lean = acting(dataclasses.replace(config, sensors={name: {} for name in config.sensors}))
    model = kernel.build(lean.effects, compiled=False)
    plant = Plant(model, lean.plant, lean.step)
    sensors = Sensors(model, lean.sensors, 1e-3, np.random.default_rng(1))
    sensors.sample(plant.signal_vector, plant.path)
    assert sensors.reading[0] == plant.signals.pressure_a
    assert not sensors.overrange.any()


def test_a_configuration_is_compiled_once() -> None:
    """A second start loads the machine code of the first from the cache."""
    lean = acting(reference())
    for _ in range(2):
        model = kernel.build(lean.effects, cache_folder())
        Plant(model, lean.plant, lean.step).step(1)
    assert sum(model.tick_and_report.stats.cache_hits.values()) == 1  # type: ignore[attr-defined]
    assert not model.tick_and_report.stats.cache_misses  # type: ignore[attr-defined]
