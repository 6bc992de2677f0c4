"""Integrations that are compiled for the acting effects only."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.records import Tick
from hil_emulator.identify.prediction.model_run.run import INPUT_COUNT
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import ticks
from hil_emulator.identify.prediction.plant.machine_code import bind
from hil_emulator.identify.prediction.plant.plant_model import PlantModel, probed
from hil_emulator.identify.prediction.plant.ticks import Ticks
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.quantities import INPUTS
from hil_emulator.model.sensors import CHANNELS, wiring
from hil_emulator.model.stages import SAMPLED
from tests.identify.rig_data import CACHE, INSTRUMENTS, knee, recorded

STEP = 2.5e-4
STEPS = 4


@pytest.fixture(scope="module")
def model() -> PlantModel:
    """Return the reference machine."""
    return PlantModel(knee(), CACHE)


def at_once(patched: pytest.MonkeyPatch, steps: int = 1) -> None:
    """Have code made after so many steps, whether or not the whole model came from the cache."""
    patched.setattr(ticks, "WORTH_COMPILING", steps)
    patched.setattr(ticks, "WORTH_COMPILING_ALL", steps)


def with_leakage(model: PlantModel) -> Array:
    """Return the parameters of a machine that leaks to the outside."""
    leak = next(e for e in model.effects if e.name == "external_leakage")
    return model.memory([model.knob(leak, "", np.inf)], [1.0])[0]


def course(model: PlantModel, tick: Tick) -> Array:
    """Return states, and what sensors see, along a run in which the rod moves to and fro."""
    wired = np.unique(wiring(model.signal_names)[:, [0, 2]]).astype(np.int64)
    state = model.start(model.par, STEP, None)
    past, inputs = np.full(model.remembered[0], np.nan), np.zeros(INPUT_COUNT)
    signals, path = np.zeros(len(model.signal_names)), np.zeros((STEPS, len(CHANNELS)))
    rows = []
    inputs[[q.name for q in INPUTS].index("transverse_force")] = 20.0
    for k in range(300):
        inputs[0] = 8e-3 if k % 100 < 50 else -8e-3
        tick(state, past, model.par, inputs, signals, path, STEP, STEPS)
        rows.append(np.concatenate([state, signals[wired], path.ravel()]))
    return np.array(rows)


def test_reduced_code_computes_the_same(
    model: PlantModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code for the acting effects gives the same bits, and is found again in the cache."""
    kept = Ticks(model.kernel, tmp_path)
    with monkeypatch.context() as patched:
        at_once(patched)
        compiled = kept.at(model.par, 1)
    assert compiled is not kept.whole
    np.testing.assert_array_equal(course(model, compiled), course(model, kept.whole))
    again = Ticks(model.kernel, tmp_path)
    assert again.at(model.par, ticks.WORTH_LOADING) is not again.whole


def test_probes_act_with_reduced_code(
    model: PlantModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A term has the same influence with any compiled code, also if steps jump.

    Runs with a probe use the whole code.
    """
    experiment, added = recorded({}, "steps", 3), []
    for worth in (ticks.WORTH_COMPILING, 1):
        with monkeypatch.context() as patched:
            at_once(patched, worth)
            patched.setattr(model, "loops", replace(model.loops, ticks=Ticks(model.kernel, None)))
            observer = Observer(model, INSTRUMENTS)
            frozen = observer.freeze(experiment, model.par, model.chan)
            tick = model.loops.ticks.at(model.par, 1)
            assert (tick is model.loops.ticks.whole) == (worth > 1)
            added.append(observer.probed(frozen))
    for one, other in zip(*added, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_loops_are_compiled_once_for_all_models(model: PlantModel) -> None:
    """A model with further effects compiles its own functions, but no loop again."""
    sensors = tuple(effect for effect in CATALOGUE if effect.stage in SAMPLED)
    other, loops_before = bind(probed(sensors, CACHE), CACHE), model.loops
    assert other.rate is not loops_before.rate
    loops = [name for name, loop in vars(loops_before).items() if isinstance(loop, Dispatcher)]
    assert "predict" in loops
    assert all(getattr(other, name) is getattr(loops_before, name) for name in loops)


@pytest.mark.slow
def test_code_is_loaded_only_for_many_steps(
    model: PlantModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cached code is not loaded for few steps that other code can take."""
    kept = Ticks(model.kernel, tmp_path)
    leaking = with_leakage(model)
    with monkeypatch.context() as patched:
        at_once(patched)
        first = kept.at(model.par, 1), kept.at(leaking, 1)
    assert first[0] is not first[1]
    again = Ticks(model.kernel, tmp_path)
    assert again.at(model.par, 1) is again.whole
    leaks = again.at(leaking, ticks.WORTH_LOADING)
    assert leaks is not again.whole
    assert again.at(model.par, 1) is leaks
    assert again.at(model.par, ticks.WORTH_LOADING) not in (again.whole, leaks)


def test_a_damaged_list_of_effects_is_ignored(model: PlantModel, tmp_path: Path) -> None:
    """Cached code is used only if the list of its effects is intact."""
    folder = Ticks(model.kernel, tmp_path)._folder()
    assert folder
    for k, content in enumerate((b"", b"viscous_fric", b"\xff\x00")):
        (folder / f"{k}.acting").write_bytes(content)
    (folder / "folder.acting").mkdir()
    kept = Ticks(model.kernel, tmp_path)
    assert kept.at(model.par, ticks.WORTH_LOADING) is kept.whole


def test_an_acting_effect_is_in_the_code(
    model: PlantModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step with an effect on is never taken by code without the effect."""
    kept = Ticks(model.kernel, tmp_path)
    leaking = with_leakage(model)
    with monkeypatch.context() as patched:
        at_once(patched)
        kept.at(model.par, 1)
    assert kept.at(leaking, 1) is kept.whole


def test_code_takes_the_steps_without_its_effects_as_well(
    model: PlantModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps without an effect count for code with this effect, once the effect acts as well."""
    kept = Ticks(model.kernel, tmp_path)
    leaking = with_leakage(model)
    at_once(monkeypatch, 100)
    assert kept.at(model.par, 99) is kept.whole
    assert kept.at(leaking, 5) is kept.whole
    made = kept.at(leaking, 50)
    assert made is not kept.whole
    assert kept.at(model.par, 1) is made
