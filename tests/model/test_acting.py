"""Integrations in which only some effects act."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from reference_machine import STEP, machine

from hil_emulator.model import kernel
from hil_emulator.model.acting import build_acting, has_parts
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.plant import Plant
from hil_emulator.model.sensors import CHANNELS, wiring
from hil_emulator.platform.paths import cache_folder

ON = ("viscous_friction", "coulomb_friction", "end_stops", "external_leakage", "transport_delay")
"""Friction, stops, flow, and the delay that stores set points."""

OFF = ("spool_rate_limit", "current_saturation", "entrained_air", "accumulator", "driver_lag")
"""Effects that are off at infinity are included, and some that have states."""


@pytest.fixture(scope="module")
def small() -> kernel.Kernel:
    """Return a model of these effects alone; its machine code outlives the session."""
    return kernel.build([e for e in CATALOGUE if e.name in (*ON, *OFF)], cache_folder())


def acting(small: kernel.Kernel, names: Sequence[str]) -> Callable[..., bool]:
    """Return the integration in which only some effects act."""
    return build_acting(small, [e for e in small.effects if e.name in names], cache_folder())


def course(
    model: kernel.Kernel, tick: Callable[..., bool], on: Sequence[str] = ON
) -> np.ndarray[Any, Any]:
    """Return states and measured signals of a rod that moves to and fro up to its stop."""
    effects = [e for e in model.effects if e.name in on]
    knobs = {e.field_of(e.knob): e.knob.typical for e in effects}
    base = {name: value for name, value in machine().items() if name in model.parameters.names}
    off = {e.field_of(e.knob): e.off for e in model.effects if e.name not in on}
    plant = Plant(model, base | knobs | off, STEP)
    supply, path, rows = plant.supply, np.zeros((4, len(CHANNELS))), []
    measured = np.unique(wiring(model.signals.names or ())[:, [0, 2]]).astype(int)
    for k in range(600):
        plant.inputs.valve_current = 8e-3 if k % 300 < 200 else -8e-3
        assert tick(
            supply.states, supply.past, supply.parameters, supply.inputs, supply.signals, path,
            STEP, 4,
        )  # fmt: skip
        rows.append(np.concatenate([supply.states, supply.signals[measured], path[-1]]))
    return np.array(rows)


def test_code_for_what_acts_computes_what_all_code_does(small: kernel.Kernel) -> None:
    """The results agree to the last bit, in a run in which every active effect matters."""
    tick = acting(small, ON)
    run = course(small, tick)
    np.testing.assert_array_equal(run, course(small, small.tick))
    assert len(np.unique(run[:, 0])) > 300


def test_every_integration_has_its_own_module(small: kernel.Kernel) -> None:
    """Numba names machine code by module and a counter of the process.

    With one module for all, integrations that two processes have compiled may have one name, and a
    third process would run the first that it loads in place of the other.
    """
    ticks: list[Any] = [small.tick, acting(small, ON), acting(small, ON[:3])]
    assert len({tick.py_func.__module__ for tick in ticks}) == len(ticks)


def test_all_effects_may_act(small: kernel.Kernel) -> None:
    """With all effects active, the run is the same."""
    np.testing.assert_array_equal(
        course(small, acting(small, (*ON, *OFF))), course(small, small.tick)
    )


def test_other_effects_are_off_in_it(small: kernel.Kernel) -> None:
    """Code without leakage computes a tight machine from the parameters of a leaking one."""
    ignorant = acting(small, ON[:3])
    run = course(small, ignorant)
    np.testing.assert_array_equal(run, course(small, small.tick, on=ON[:3]))
    assert not np.array_equal(run, course(small, small.tick))


@pytest.mark.slow
def test_whether_a_process_has_what_it_is_made_of(small: kernel.Kernel) -> None:
    """It has it after the whole model was compiled in this process, and not before."""
    compiled_here = kernel.build(small.effects)
    assert not has_parts(compiled_here)
    course(compiled_here, compiled_here.tick)
    assert has_parts(compiled_here)
