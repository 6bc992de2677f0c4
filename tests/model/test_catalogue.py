"""Properties that every effect of the catalogue has."""

import ast
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from reference_machine import STEP, machine

from hil_emulator.model import kernel
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors

TICK = 1e-3

PLANT = [e for e in CATALOGUE if e.stage.table != "sensors"]
CHAIN = [e for e in CATALOGUE if e.stage.table == "sensors"]

NO_STOP = {"initial_position": 0.01, "coulomb_friction_force": 0.0}

AROUND: Mapping[str, Mapping[str, float]] = {
    # what must be there for an effect to have something to act on
    "oil_heating": {"viscosity_temperature_slope": 3.68},
    "accumulator": {"variable_pump_flow": 1e-4},
    "pump_leakage": {"fixed_pump_flow": 10e-3 / 60},
    "pump_friction": {"fixed_pump_flow": 10e-3 / 60},
    "friction_asymmetry": {"coulomb_friction_force": 100.0},
    "position_friction": {"viscous_friction_coefficient": 1000.0},
    "friction_along_stroke": {"viscous_friction_coefficient": 1000.0},
    # dry friction on a light rod turns over a wider velocity, however stiff the coupling
    # and an end stop is no stiffer than a load cell: its impacts would be compared
    "coupling_compliance": NO_STOP | {"rod_mass_mass": 0.286},
    "backlash": NO_STOP | {"rod_mass_mass": 0.286},
}

WEAKER: Mapping[str, tuple[float, float]] = {
    "end_stops": (1e-5, 1e-7),
    "entrained_air": (0.1, 0.01),
}
"""Shares of the typical strength at which an effect has faded, where a quarter is still strong."""


NOT_COMPARED = frozenset(
    {
        "gas_pressure",
        "pump_flow",
        "relief_flow",
        "return_flow",
        "pump_power",
        "shaft_power",
        "shaft_torque",
        "efficiency",
    }
)
"""Signals of the model or the pump: the size of a pump shows as an effect at the valve only."""


EXCEPT = {
    "variable_pump": "a larger pump droops less but rings more: its own test shows the droop fade",
    "spool_feedback": "a slower loop corrects later, not less: its own test shows the bandwidth",
    "pilot_check_valves": "a machine has them or has not: a smaller pilot opens later",
    "shut_off_valves": "a machine has them or has not: open ones of any speed are the same",
}
"""Why the strength of an effect does not fade towards off."""


def scene(effect: Effect, **changes: float) -> dict[str, float]:
    """Return a machine that meets most effects on its way: warm oil, near the rod end."""
    values = machine(
        oil_temperature=333.15,
        initial_position=0.072,
        load_mass=20.0,
        current_saturation_limit=0.02,
    )
    return values | dict(AROUND.get(effect.name, {})) | {knob_of(effect): effect.off} | changes


def knob_of(effect: Effect) -> str:
    """Return the field of an effect's knob."""
    return effect.field_of(effect.knob)


def run(model: kernel.Kernel, values: Mapping[str, float], ticks: int, steps: int) -> np.ndarray:
    """Drive the machine out into the stop, back, and let it cavitate; signals of every tick."""
    parameters = {n: v for n, v in values.items() if n in model.parameters.names}
    plant = Plant(model, parameters, STEP)
    rows = []
    for i in range(ticks):
        part = i / ticks
        plant.inputs.valve_current = 0.012 if part < 0.3 else -3e-3 if part < 0.6 else 0.0
        plant.inputs.external_force = -4000.0 if part > 0.8 else 300.0
        plant.step(steps)
        rows.append(plant.signal_vector.copy())
    return np.array(rows)


def strength(effect: Effect, share: float) -> float:
    """Return the knob at a share of the way from off to typical; off at infinity is 1/share."""
    if math.isinf(effect.off):
        return effect.knob.typical / share
    return effect.off + share * (effect.knob.typical - effect.off)


@pytest.mark.parametrize("effect", PLANT, ids=lambda e: e.name)
def test_off_is_bit_identical_to_absent(effect: Effect) -> None:
    """A model without the effect computes the same bits as one in which it is off."""
    with_it = run(kernel.build(compiled=False), scene(effect), ticks=6, steps=2)
    others = tuple(e for e in CATALOGUE if e is not effect)
    without = run(kernel.build(others, compiled=False), scene(effect), ticks=6, steps=2)
    assert np.array_equal(with_it, without)


@pytest.mark.parametrize("effect", PLANT, ids=lambda e: e.name)
def test_typical_is_visible_and_fades_towards_off(effect: Effect, model: kernel.Kernel) -> None:
    """At its typical strength an effect changes a signal; at half and a quarter it does so less."""
    kept = [n not in NOT_COMPARED for n in model.signals.names]
    without = run(model, scene(effect), ticks=150, steps=50)[:, kept]
    runs = [
        run(model, scene(effect, **{knob_of(effect): strength(effect, share)}), 150, 50)[:, kept]
        for share in (1.0, *WEAKER.get(effect.name, (0.5, 0.25)))
    ]
    assert np.all(np.isfinite(runs))
    span = np.maximum(np.abs([without, *runs]).max(axis=(0, 1)), 1e-12)
    shown = [float(np.mean(np.abs(r - without) / span)) for r in runs]
    assert shown[0] > 1e-6
    if effect.name in EXCEPT:
        return
    assert shown[0] > shown[1] >= shown[2]
    assert shown[2] < 0.75 * shown[0]


def readings(model: kernel.Kernel, values: Mapping[str, float]) -> np.ndarray:
    """Let every channel show the same run, with a hidden transverse force."""
    plant = Plant(model, machine(), STEP)
    names = model.channel.names
    # an estimator of velocity applies to its own channel only
    where = ("velocity",) if "velocity_estimator_window" in values else ("position", "velocity")
    channels = {n: {f: v for f, v in values.items() if f in names} for n in where}
    sensors = Sensors(model, channels, TICK, np.random.default_rng(1))
    rows = []
    for i in range(40):
        plant.inputs.valve_current = 3e-3 * math.sin(i)
        plant.step(50)
        sensors.sample(plant.signal_vector, plant.path)
        rows.append(sensors.reading.copy())
    return np.array(rows)


@pytest.mark.parametrize("effect", CHAIN, ids=lambda e: e.name)
def test_sensor_effects_vanish_at_off_show_and_fade(effect: Effect, model: kernel.Kernel) -> None:
    """Off leaves the reading unchanged to the bit; typical changes it; a quarter does so less."""
    clean = readings(model, {})
    assert np.array_equal(clean, readings(model, {knob_of(effect): effect.off}))
    if effect.name == "measuring_range":
        full, part = 0.0, 0.09  # the typical range would never be left
    else:
        full, part = strength(effect, 1.0), strength(effect, 0.25)
    shown = [np.abs(readings(model, {knob_of(effect): k}) - clean).max() for k in (full, part)]
    assert shown[0] > 1e-9
    assert shown[1] < 0.75 * shown[0]


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_every_effect_is_documented(effect: Effect) -> None:
    """Equation, source, signature, units and meanings are there, and the numbers make sense."""
    assert "=" in effect.equation
    assert effect.source
    assert effect.signature
    for param in effect.params:
        assert param.meaning
        assert param.unit
        assert param.low <= param.typical <= param.high
        assert param.source
    assert is_on(effect, effect.knob.typical)
    assert not is_on(effect, effect.off)
    at_a_bound = effect.off in (effect.knob.low, effect.knob.high)
    assert at_a_bound or effect.knob.low < effect.off < effect.knob.high
    for param in effect.shape:
        assert param.default is not None


def test_the_catalogue_is_large_and_its_names_are_single() -> None:
    """At least 40 effects, each named once."""
    names = [e.name for e in CATALOGUE]
    assert len(set(names)) == len(names) >= 40


def test_every_effect_has_a_test_of_its_physics() -> None:
    """A test named `test_<effect>_...` in this folder compares its law with a reference.

    The tests above check what all effects have in common: an effect with a wrong equation would
    pass them.
    """
    tests = {
        node.name
        for file in Path(__file__).parent.glob("test_*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.FunctionDef)
    }
    untested = [
        e.name for e in CATALOGUE if not any(t.startswith(f"test_{e.name}_") for t in tests)
    ]
    assert not untested
