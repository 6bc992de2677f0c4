"""The default step with every effect at its typical strength, against Radau at rtol 1e-10.

Radau solves the compiled right-hand side, so this checks the integrator alone. Other tests check
the right-hand side.
"""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from reference_machine import STEP, machine
from scipy.integrate import solve_ivp

from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import zeros
from hil_emulator.model.plant import Plant

TICK = 4e-3
RANGES = {
    "pressure_a": 160e5, "pressure_b": 160e5, "supply_pressure": 160e5, "position": 0.08,
    "velocity": 1.0, "load_force": 5000.0,
}  # fmt: skip
SCALES = {"pressure": 1e5, "position": 1e-3, "velocity": 1e-2, "speed": 1.0, "stretch": 1e-6}

PLANT = [e for e in CATALOGUE if e.stage.table != "sensors" and e.name != "transport_delay"]
"""A delay of the set point is nothing that is integrated."""

# (ticks, current, external force): into the stop and stalled there, reversed, run empty, refilled
ROAD = (
    (2, 6e-3, 0.0), (3, 8e-3, 0.0), (2, -4e-3, 0.0), (2, 0.0, -4000.0), (3, -2e-3, 500.0),
)  # fmt: skip


def scales(model: Kernel) -> np.ndarray:
    """Return a small deviation of each state, so that the solver's tolerances mean the same."""
    values = []
    for name in model.state.names:
        fits = [size for part, size in SCALES.items() if part in name]
        values.append(fits[0] if fits else 1e-4)
    return np.array(values)


def exact(plant: Plant, seconds: float) -> np.ndarray:
    """Advance a copy of the plant's state by Radau; return the signals there."""
    kernel, scale = plant.kernel, scales(plant.kernel)
    rates, signals = zeros(kernel.state), zeros(kernel.signals)

    def slope(_: float, z: np.ndarray) -> np.ndarray:
        kernel.rate(z * scale, rates, plant.parameter_vector, plant.input_vector, signals)
        return rates / scale

    solved = solve_ivp(
        slope, (0.0, seconds), plant.state_vector / scale, method="Radau", rtol=1e-10, atol=1e-9,
        t_eval=[seconds],
    )  # fmt: skip
    assert solved.success, solved.message
    plant.state_vector[:] = solved.y[:, -1] * scale
    plant.step(0)
    return plant.signal_vector


def worst_error(model: Kernel, values: Mapping[str, float]) -> float:
    """Return the largest error on any channel along the road, as a part of its range."""
    stepped, solved = Plant(model, values, STEP), Plant(model, values, STEP)
    names = list(model.signals.names)
    columns = [names.index(n) for n in RANGES]
    worst = 0.0
    for ticks, current, force in ROAD:
        for plant in (stepped, solved):
            plant.inputs.valve_current = current
            plant.inputs.external_force = force
        for _ in range(ticks):
            stepped.step(round(TICK / STEP))
            exact(solved, TICK)
            error = np.abs(stepped.signal_vector - solved.signal_vector)[columns]
            worst = max(worst, float(np.max(error / list(RANGES.values()))))
    return worst


def on(*effects: Effect) -> dict[str, float]:
    """Return the reference machine near the rod end, in warm oil, with effects at typical."""
    values = machine(
        initial_position=0.074, oil_temperature=333.15, load_mass=20.0, wall_distance=0.079
    )
    return values | {e.field_of(e.knob): e.knob.typical for e in effects}


def test_every_effect_together_is_exact_to_a_thousandth(model: Kernel) -> None:
    """Impact, stall, reversal and cavitation with the whole catalogue on: below 0.1 % of range."""
    error = worst_error(model, on(*PLANT))
    print(f"all: {error:.1e}")
    assert error < 1e-3


@pytest.mark.full(sibling="test_every_effect_together_is_exact_to_a_thousandth")
@pytest.mark.parametrize("effect", PLANT, ids=lambda e: e.name)
def test_each_effect_is_exact_to_a_thousandth(effect: Effect, model: Kernel) -> None:
    """The same with one effect at a time on top of the reference machine."""
    extra = {"rod_mass_mass": 0.286} if effect.stage.name in ("coupling", "play") else {}
    error = worst_error(model, on(effect) | extra)
    print(f"{effect.name}: {error:.1e}")
    assert math.isfinite(error)
    assert error < 1e-3
