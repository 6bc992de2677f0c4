"""A valve with a flow meter: what its current and the pressures at its ports make of the flow."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.flow_bench import FlowBench, flow_bench
from hil_emulator.identify.session import Question, identify
from hil_emulator.model.plant import Plant
from tests.identify.rig_data import CACHE, PERIOD, knee, knee_model

NOISE = 3e-7
"""Of the flow meter: 0.02 l/min [m^3/s]."""


def metered(
    changes: Mapping[str, float], kind: str, seed: int, duration: float = 1.5
) -> Experiment:
    """Record a valve between ports at given pressures: chambers that no flow fills."""
    model = knee_model()
    random = np.random.default_rng(seed)
    values = dict(model.plant_values) | {"load_mass": 1e12, "valve_gain": 1.06 * 6.68e-6}
    values |= {"cylinder_dead_volume_a": 1e3, "cylinder_dead_volume_b": 1e3}
    plant = Plant(model.kernel, values | dict(changes), 2e-5)
    plant.set_pressures(80e5, 80e5)
    time = np.arange(round(1.5 / PERIOD)) * PERIOD
    if kind == "triangles":
        current = 5e-3 * (2.0 * np.abs(2.0 * (time / 0.75 % 1.0) - 1.0) - 1.0)
    else:
        current = random.uniform(-4e-3, 4e-3, 40)[(time / 0.05).astype(int) % 40]
    flow, pressure = np.zeros(len(time)), np.zeros(len(time))
    for k, value in enumerate(current):
        flow[k], pressure[k] = plant.signals.flow_a, plant.signals.pressure_a
        plant.command({"valve_current": value})
        plant.step(50)
    readings = {
        "flow_a": flow + NOISE * random.standard_normal(len(time)),
        "pressure_a": pressure + 1e4 * random.standard_normal(len(time)),
        "pressure_b": pressure + 1e4 * random.standard_normal(len(time)),
        "supply_pressure": 160e5 + 1e4 * random.standard_normal(len(time)),
    }
    return Experiment(f"{kind}-{seed}", PERIOD, current, readings)


def test_the_right_model_leaves_the_meters_noise() -> None:
    """With the machine's own gain, what remains is as large as the noise, and white."""
    model = knee_model()
    e = metered({"valve_gain": model.plant_values["valve_gain"]}, "steps", 1)
    predictor, why = flow_bench(model, [e])
    assert isinstance(predictor, FlowBench), why
    frozen = predictor.freeze(e, predictor.model.par, predictor.model.chan)
    rest = predictor.innovations(frozen, predictor.model.par, predictor.model.chan)[0][
        frozen.present, 0
    ]
    assert np.std(rest) == pytest.approx(NOISE, rel=0.1)


def test_a_flow_alone_is_too_little() -> None:
    """Without the pressure at the port no edge is known; the message names the missing channel."""
    e = metered({}, "steps", 1)
    fewer = {n: v for n, v in e.readings.items() if n != "pressure_a"}
    result = identify(knee(), [replace(e, readings=fewer)], cache=CACHE)
    assert result.verdict == "cannot_examine"
    assert "flow_a without pressure_a" in result.reason


@pytest.mark.slow
def test_the_edge_that_is_worn_is_named() -> None:
    """A-T opens late by 0.2 mA: not P-A, not a shifted null, no lap of all edges, no gain."""
    late = {"lap_at_lap": 2e-4}
    edges = [f"{kind}_{edge}" for kind in ("lap", "gain") for edge in ("sa", "at", "sb", "bt")]
    shared = ["null_bias", "overlap", "underlap", "gain_asymmetry"]
    result = identify(
        knee(), [metered(late, "triangles", 1)], [metered(late, "triangles", 9)],
        Question(only=[*edges, *shared]), cache=CACHE,
    )  # fmt: skip
    (finding,) = result.effects
    assert finding.name == "lap_at"
    low, high = finding.interval
    assert low < 2e-4 < high
    assert high - low < 3e-5


FULL = pytest.mark.full(sibling="test_effects_of_the_valve_are_named")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "names"),
    [
        pytest.param({"null_bias_bias": 1e-4}, [{"null_bias"}], marks=FULL),
        # seen from one chamber, with a gain that is unknown, these are one and the same
        ({"gain_asymmetry_asymmetry": 0.05}, [{"gain_asymmetry", "gain_sa", "gain_at"}]),
        pytest.param({}, [], marks=FULL),
    ],
)
def test_effects_of_the_valve_are_named(
    changes: Mapping[str, float], names: list[set[str]]
) -> None:
    """From current, pressures and flow; a gain that is 6 % off is no effect."""
    kinds = ("steps", "triangles", "steps")
    train = [metered(changes, kind, 1 + i) for i, kind in enumerate(kinds)]
    result = identify(knee(), train, [metered(changes, "triangles", 9)], cache=CACHE)
    assert len(result.effects) == len(names)
    for finding, alike in zip(result.effects, names, strict=True):
        assert finding.name in alike
        assert alike - {finding.name} <= {*finding.group, *(rival.name for rival in finding.rivals)}
    assert {"stribeck_friction", "internal_leakage", "line_compliance"} <= set(result.unseen)
