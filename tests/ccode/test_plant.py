"""The plant in C is the plant that runs here."""

import dataclasses
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil_emulator.ccode.c_types import TranslationError
from hil_emulator.ccode.compiler import WINDOWS, CompilerError, build_library, host
from hil_emulator.ccode.library import CompiledPlant, write_sources
from hil_emulator.ccode.plant_source import Exported, sources
from hil_emulator.config.load import load
from hil_emulator.model.declare import Param, effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.kernel import Kernel, build
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import SAMPLED, friction
from hil_emulator.platform.paths import cache_folder, shipped

STEP, STEPS = 2e-5, 50
REFERENCE = load([shipped("configs/hyq_knee.toml")])
WHOLE = Exported("plant", "whole catalogue", CATALOGUE, REFERENCE.plant, {}, STEP, STEPS, seed=1)


@pytest.fixture(scope="module")
def model() -> Kernel:
    """Compile the whole catalogue once; its machine code outlives the session."""
    return build(cache=cache_folder())


@pytest.fixture(scope="module")
def in_c(model: Kernel) -> Iterator[CompiledPlant]:
    """Return the whole catalogue in C."""
    if host() is None:
        pytest.skip("no name for this system")
    try:
        yield CompiledPlant(WHOLE, model)
    except CompilerError as error:
        pytest.skip(str(error))


def draw(random: np.random.Generator) -> dict[str, float]:
    """Return a machine: every number near the reference's, a third of the effects on."""
    values = {n: v * random.uniform(0.7, 1.4) if v else v for n, v in REFERENCE.plant.items()}
    values["initial_position"] = random.uniform(0.01, 0.07)
    values["oil_temperature"] = random.uniform(290.0, 340.0)
    for chosen in CATALOGUE:
        if chosen.stage not in SAMPLED and random.random() < 0.35:
            values |= {chosen.field_of(p): p.typical for p in chosen.params}
    return values


def chain(random: np.random.Generator) -> dict[str, dict[str, float]]:
    """Return transducers without noise, a third of their effects on."""
    effects = [e for e in CATALOGUE if e.stage in SAMPLED and e.name != "noise"]
    return {
        c.name: {
            e.field_of(p): p.typical * (c.span if p.unit == "span" else 1.0)
            for e in effects
            if random.random() < 0.35 and (e.name != "velocity_estimator" or c.differenced)
            for p in e.params
        }
        for c in CHANNELS
    }


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_its_trajectories_are_those_of_the_built_in_plant(
    seed: int, model: Kernel, in_c: CompiledPlant
) -> None:
    """Whatever machine, transducers and inputs: within 1e-9 of each signal's range."""
    random = np.random.default_rng(seed)
    plant = Plant(model, draw(random), STEP)
    sensors = Sensors(model, chain(random), STEP * STEPS, random)
    memory: Any = in_c.memory[0]
    memory["parameters"] = plant.parameter_vector
    memory["sensors"].flat = sensors.parameters
    memory["inputs"] = 0.0
    in_c.start()
    sensors.sample(plant.signal_vector, plant.path)
    here, there = [], []
    for _ in range(60):
        inputs = random.normal(size=4) * (3e-3, 500.0, 300.0, 1e-3)
        plant.input_vector[:] = memory["inputs"] = inputs
        assert plant.step(STEPS) == in_c.tick()
        sensors.sample(plant.signal_vector, plant.path)
        here.append([*plant.signal_vector, *sensors.reading, *sensors.overrange])
        there.append([*memory["signals"], *memory["reading"], *memory["overrange"]])
    ours, theirs = np.array(here), np.array(there)
    spread = np.ptp(ours, axis=0) + 1e-9 * np.abs(ours).max(axis=0)
    assert np.all(np.abs(ours - theirs) <= 1e-9 * spread)


def test_a_copy_of_its_memory_is_its_state(in_c: CompiledPlant) -> None:
    """What happened once happens again from a copy: there is no memory elsewhere."""
    memory: Any = in_c.memory
    in_c.start()
    memory["inputs"][0] = (2e-3, 100.0, 0.0, 0.0)
    kept = memory.copy()
    runs = []
    for _ in range(2):
        memory[:] = kept
        runs.append([(in_c.tick(), memory["signals"].copy())[1] for _ in range(20)])
    assert np.array_equal(*np.array(runs), equal_nan=True)


def test_noise_has_the_stated_deviation(in_c: CompiledPlant, model: Kernel) -> None:
    """Seven channels at rest, a hundred samples: mean and deviation as of normal numbers."""
    memory: Any = in_c.memory[0]
    memory["parameters"] = Plant(model, REFERENCE.plant, STEP).parameter_vector
    memory["sensors"].flat = Sensors(model, {}, STEP, np.random.default_rng()).parameters
    memory["inputs"] = 0.0
    readings = []
    for sigma in (0.0, 1.0):
        memory["sensors"][:, (model.channel.names or ()).index("noise_sigma")] = sigma
        in_c.start()
        readings.append([(in_c.tick(), memory["reading"].copy())[1] for _ in range(100)])
    normal = np.subtract(*readings[::-1]).ravel()
    assert abs(normal.mean()) < 4.0 / np.sqrt(normal.size)
    assert abs(normal.std() - 1.0) < 4.0 / np.sqrt(2.0 * normal.size)


@pytest.mark.slow
def test_single_precision_keeps_what_its_documentation_says(model: Kernel) -> None:
    """Half a second of a moving rod: each channel within a thousandth of its span."""
    try:
        plants = [CompiledPlant(WHOLE, model, single=single) for single in (False, True)]
    except CompilerError as error:
        pytest.skip(str(error))
    rows = []
    for plant in plants:
        memory: Any = plant.memory[0]
        plant.start()
        readings = []
        for tick in range(500):
            memory["inputs"][0] = 1e-3 * np.sin(tick * 0.02)
            assert plant.tick()
            readings.append(memory["reading"].astype(float))
        rows.append(readings)
    error = np.abs(np.subtract(*rows)).max(axis=0) / [c.span for c in CHANNELS]
    assert error.max() < 1e-3


@pytest.mark.parametrize("single", [False, True])
def test_it_is_plain_c99_that_allocates_nothing(single: bool, tmp_path: Path) -> None:
    """A pedantic compiler gives no warning; no memory is allocated; float is not widened."""
    files = write_sources(WHOLE, tmp_path, single=single)
    text = files[0].read_text()
    assert not re.search(r"\b(malloc|calloc|realloc|alloca|free)\b", text)
    if host() is None:
        pytest.skip("no name for this system")
    words = ["cc", "-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Wno-unused-parameter",
             "-Werror", "-fsyntax-only", str(files[0]),
             *(["-Wdouble-promotion"] if single else [])]  # fmt: skip
    try:
        subprocess.run(words, check=True, capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("no C compiler")


def test_another_system_needs_the_cross_compiler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without `ziglang` a library for Windows cannot be built here; a message explains it."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(CompilerError, match="cross"):
        build_library([], tmp_path / "plant.dll", WINDOWS)


def test_an_effect_of_the_users_own_comes_along_or_is_named() -> None:
    """A law of plain arithmetic is translated; one that calls numpy is refused by name."""
    header, body = sources(dataclasses.replace(WHOLE, effects=(*CATALOGUE, cubic_drag)))
    assert "double cubic_drag_strength; /* [N*s^3/m^3] cubic drag */" in header
    assert "return strength * velocity * velocity * velocity;" in body
    with pytest.raises(TranslationError, match="numpy_drag"):
        sources(dataclasses.replace(WHOLE, effects=(*CATALOGUE, numpy_drag)))


@effect(
    friction,
    knob=Param("strength", "N*s^3/m^3", "cubic drag", 50.0, 0.0, 1e4),
    source="assumed",
    signature="high speed",
)
def cubic_drag(velocity: float, strength: float) -> float:
    """F = C v³."""
    return strength * velocity * velocity * velocity


@effect(
    friction,
    knob=Param("strength", "N*s/m", "drag", 50.0, 0.0, 1e4),
    source="assumed",
    signature="high speed",
)
def numpy_drag(velocity: float, strength: float) -> float:
    """F = C v."""
    return float(np.multiply(strength, velocity))
