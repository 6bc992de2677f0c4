"""A valve with blocked ports: closed chambers, or its spool alone, and nothing of the load."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.edge_flow import through_edge
from hil_emulator.identify.prediction.benches.valve_bench import ValveBench, bench
from hil_emulator.identify.session import identify
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.servo_valve import edge_flow, transition
from tests.identify.rig_data import CACHE, OFF, PERIOD, knee, knee_model, recorded

CHANNELS = ("pressure_a", "pressure_b", "supply_pressure")


def blocked(
    changes: Mapping[str, float], kind: str, seed: int, duration: float = 2.0
) -> Experiment:
    """Record a valve whose ports are blocked: a cylinder with a load that nothing moves."""
    model, config = knee_model(), knee()
    random = np.random.default_rng(seed)
    values = {n: v * OFF.get(n, 1.0) for n, v in model.plant_values.items()}
    plant = Plant(model.kernel, values | {"load_mass": 1e12} | dict(changes), 2e-5)
    readings = Sensors(model.kernel, config.sensors, PERIOD, random)
    time = np.arange(round(duration / PERIOD)) * PERIOD
    if kind == "multisine":
        frequencies = np.array([0.7, 1.9, 5.3, 13.0, 31.0, 71.0])
        phases = random.uniform(0.0, 2.0 * np.pi, len(frequencies))
        waves = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases)
        current = waves @ np.array([60.0, 40.0, 40.0, 40.0, 30.0, 30.0]) * 1e-6
    else:
        current = random.uniform(-3e-4, 3e-4, 40)[(time / 0.1).astype(int) % 40]
    table = np.zeros((len(time), len(readings.names)))
    for k, value in enumerate(current):
        readings.sample(plant.signal_vector, plant.path)
        table[k] = readings.reading
        plant.command({"valve_current": value})
        plant.step(50)
    measured = {n: table[:, readings.names.index(n)].copy() for n in (*CHANNELS, "spool_position")}
    measured["spool_position"] += random.normal(0.0, 1e-5, len(time))
    return Experiment(f"{kind}-{seed}", PERIOD, current, measured)


def only(e: Experiment, *channels: str) -> Experiment:
    """Return an experiment with some of its channels."""
    return replace(e, readings={n: v for n, v in e.readings.items() if n in channels})


def test_closed_chambers_are_distinguished_from_a_rod_without_position() -> None:
    """Pressures of blocked ports follow the valve's flow; those of a moving rod do not."""
    model = knee_model()
    for kind in ("multisine", "steps"):
        predictor, why = bench(model, [only(blocked({}, kind, 1), *CHANNELS)])
        assert isinstance(predictor, ValveBench), why
        moving = recorded({}, kind, 1)
        predictor, why = bench(model, [only(moving, *CHANNELS)])
        assert predictor is None
        assert "pressure_a does not follow the valve" in why


def test_a_dead_band_does_not_open_closed_chambers() -> None:
    """Of a current that hardly leaves the dead band a seventh of the usual flow is left."""
    rows = only(blocked({"overlap_lap": 1e-4}, "multisine", 1), *CHANNELS)
    predictor, why = bench(knee_model(), [rows])
    assert isinstance(predictor, ValveBench), why


@pytest.mark.parametrize("opening", [-1e-4, 0.0, 1e-6, 1e-4, 5e-3])
@pytest.mark.parametrize("drop", [-50e5, 0.0, 1e4, 120e5])
def test_whole_recordings_pass_the_edges_of_the_model(opening: float, drop: float) -> None:
    """Shut, creeping or turbulent: the law is that of the simulated valve."""
    plant = knee_model().plant_values
    valve = SimpleNamespace(**plant)
    law = edge_flow(valve, SimpleNamespace(transition=transition(valve, 1.0)), opening, drop)
    flow = through_edge(np.array([opening]), np.array([drop]), plant)
    assert flow[0] == pytest.approx(law, rel=1e-9)


def test_the_note_lists_the_examined_balances() -> None:
    """Spool alone; with pressures the flows, too; never a force."""
    model = knee_model()
    spool, _ = bench(model, [only(blocked({}, "steps", 1), "spool_position")])
    assert spool is not None
    assert [b.name for b in spool.balances] == ["spool"]
    ports, _ = bench(model, [only(blocked({}, "steps", 1), *CHANNELS)])
    assert ports is not None
    assert {b.name for b in ports.balances} == {
        "spool", "flow into chamber a", "flow out of chamber b", "leakage from a to b",
        "supply pressure",
    }  # fmt: skip


def test_neither_pressures_nor_spool_is_too_little() -> None:
    """A current and the supply alone show nothing of a valve."""
    result = identify(knee(), [only(blocked({}, "steps", 1), "supply_pressure")], cache=CACHE)
    assert result.verdict == "cannot_examine"
    assert "no valve_current with the spool's position or with chamber pressures" in result.reason


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "name", "value"),
    [
        pytest.param(
            {"null_bias_bias": 3e-5},
            "null_bias",
            3e-5,
            marks=pytest.mark.full(sibling="test_an_effect_of_the_valve_is_named"),
        ),
        ({"overlap_lap": 1e-4}, "overlap", 1e-4),
    ],
)
def test_an_effect_of_the_valve_is_named(
    changes: Mapping[str, float], name: str, value: float
) -> None:
    """From current and pressures of blocked ports alone; friction is out of sight."""
    kinds = ("multisine", "steps")
    train = [only(blocked(changes, kind, 1 + i), *CHANNELS) for i, kind in enumerate(kinds)]
    other = [only(blocked(changes, "steps", 101), *CHANNELS)]
    result = identify(knee(), train, other, cache=CACHE)
    assert [f.name for f in result.effects] == [name]
    assert result.effects[0].value == pytest.approx(value, rel=0.2)
    assert {"stribeck_friction", "load_spring", "gravity"} <= set(result.unseen)


@pytest.mark.full(sibling="test_an_effect_of_the_valve_is_named")
def test_a_healthy_valve_lacks_nothing() -> None:
    """Ordinary parameters off by a usual amount, and no name."""
    train = [only(blocked({}, kind, 1 + i), *CHANNELS) for i, kind in
             enumerate(("multisine", "steps"))]  # fmt: skip
    result = identify(knee(), train, [only(blocked({}, "steps", 101), *CHANNELS)], cache=CACHE)
    assert result.verdict == "nothing_missing"
