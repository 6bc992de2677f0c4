"""A servo valve in a sweep of minutes, of which nothing but its rating is configured."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.boundary import bounded, with_values
from hil_emulator.identify.prediction.benches.sweep_bench import (
    SweepBench,
    examinable,
    sweep_bench,
)
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.platform.paths import cache_folder
from tests.identify.benches.asked import asked, bench, names, recorded
from tests.identify.benches.valve import LITRES, blocked_ports, noisy, open_port, triangle

SWEEP = bench("quasi_static_sweep")


def open_valve(file: Path, top: float, cycles: int, lap: float) -> Path:
    """Record flow and pressure of an open port for 520 s."""
    time, current = triangle(520.0, 2.0, top, cycles)
    pressure = 80e5 + 15e5 * np.sin(2.0 * np.pi * time / 97.0)
    flow = 1.04 * open_port(current, pressure, lap)
    return recorded(file, {
        "time [s]": time, "valve_current [mA]": 1e3 * current,
        "flow_a [l/min]": noisy(LITRES * flow, 0.01, file),
        "pressure_a [bar]": noisy(1e-5 * pressure, 0.02, file),
    })  # fmt: skip


def blocked_valve(file: Path, top: float, cycles: int, underlap: float) -> Path:
    """Record the pressures of blocked ports for 400 s."""
    time, current = triangle(400.0, 2.0, top, cycles)
    a, b, _ = blocked_ports(current, underlap)
    return recorded(file, {
        "time [s]": time, "valve_current [mA]": 1e3 * current,
        "pressure_a [bar]": noisy(1e-5 * a, 0.1, file),
        "pressure_b [bar]": noisy(1e-5 * b, 0.1, file),
    })  # fmt: skip


@pytest.mark.slow
def test_a_valve_as_configured_agrees(tmp_path: Path) -> None:
    """The orifice equation is what remains of the model at rest: the gap is the meter's noise.

    A gain that is 4 % off is no disagreement: it is refitted.
    """
    file = open_valve(tmp_path / "sweep.csv", 6e-3, 1, 0.0)
    result, output = asked("gap", SWEEP, [file], [], tmp_path)
    assert "bench     a quasi-static sweep" in output
    assert result["verdict"] == "agrees"
    assert result["gap"]["flow_a"]["training"]["before_percent"] < 0.3
    gain = result["parameters"]["valve_gain"]
    assert gain["refitted"] == pytest.approx(1.04 * gain["configured"], rel=3e-3)


@pytest.mark.slow
def test_pressures_of_blocked_ports_are_those_at_which_flows_balance(tmp_path: Path) -> None:
    """Leakage through the edges has filled the ports: within 10 Pa of the closed form."""
    _, current = triangle(400.0, 2.0, 3e-4, 1)
    a, b, _ = blocked_ports(current, 5e-5)
    rows = Experiment("sweep", 0.5, current, {"pressure_a": a, "pressure_b": b})
    model = PlantModel(load([SWEEP]), cache_folder())
    at_rest, _ = sweep_bench(bounded(model, model.config.bench), [rows])
    assert at_rest is not None
    par, chan = with_values(at_rest.model, {"underlap_lap": 5e-5}).memory((), ())
    residual, _ = at_rest.innovations(at_rest.freeze(rows, par, chan), par, chan)
    assert np.max(np.abs(residual)) < 10.0


@pytest.mark.slow
def test_overlap_is_named_from_an_open_port(tmp_path: Path) -> None:
    """An overlap of 0.15 mA; `gap` names the spool, `identify` the effect."""
    tops = (8e-3, 4e-3, 6e-3)
    files = [open_valve(tmp_path / f"{i}.csv", t, 1 + i, 1.5e-4) for i, t in enumerate(tops)]
    gap, _ = asked("gap", SWEEP, files[:2], files[2:], tmp_path)
    assert gap["verdict"] == "disagrees"
    assert gap["where"][0]["balance"] == "spool"
    result, _ = asked("identify", SWEEP, files[:2], files[2:], tmp_path)
    assert names(result) == ["overlap"]
    low, high = result["effects"][0]["interval"]
    assert low < 1.5e-4 < high


@pytest.mark.full(sibling="test_overlap_is_named_from_an_open_port")
def test_underlap_is_named_from_blocked_ports(tmp_path: Path) -> None:
    """The pressures of blocked ports are solved for, and fall where both edges are open."""
    tops = (3e-4, 2e-4, 2.5e-4)
    files = [blocked_valve(tmp_path / f"{i}.csv", t, 1 + i, 5e-5) for i, t in enumerate(tops)]
    result, _ = asked("identify", SWEEP, files[:2], files[2:], tmp_path)
    assert names(result) == ["underlap"]
    assert result["effects"][0]["value"] == pytest.approx(5e-5, rel=0.01)


def at_rest(tmp_path: Path, valve: str, rows: Experiment) -> SweepBench:
    """Return what predicts rows of a valve that is configured with further effects."""
    text = SWEEP.read_text().replace("[valve]", f"[valve]\n{valve}")
    file = tmp_path / "valve.toml"
    file.write_text(text)
    model = PlantModel(load([file]), cache_folder())
    predictor, why = sweep_bench(bounded(model, model.config.bench), [rows])
    assert predictor is not None, why
    return predictor


def test_a_loop_is_followed_from_any_current(tmp_path: Path) -> None:
    """A sweep may begin at the rated current, where the loop is on its upper branch.

    Down from there the branch changes by Dahl's law does: z = (z0 + 1) exp((i - i0)/i_t) - 1.
    """
    current = np.linspace(10e-3, -10e-3, 401)
    rows = Experiment("sweep", 0.5, current, {"spool_position": current})
    loop = 'hysteresis = { width = "0.4 mA", transition = "0.3 mA" }'
    predictor = at_rest(tmp_path, loop, rows)
    par, chan = predictor.model.memory((), ())
    residual, _ = predictor.innovations(predictor.freeze(rows, par, chan), par, chan)
    side = 2.0 * np.exp((current - current[0]) / 3e-4) - 1.0
    assert np.max(np.abs(residual[:, 0] - 0.5 * 4e-4 * side)) < 0.04 * 4e-4


@pytest.mark.parametrize("channel", ["flow_a", "pressure_a"])
def test_no_candidate_is_beyond_what_a_sweep_can_solve(tmp_path: Path, channel: str) -> None:
    """With hysteresis and threshold, each effect at its typical size has a finite residual.

    Lags and a rate limit change nothing in a slow sweep, and lags are no candidates.
    """
    current = 3e-3 * np.sin(np.linspace(-1.5, 9.0, 60))
    readings = {channel: np.zeros(60), "pressure_a": np.full(60, 80e5)}
    rows = Experiment("sweep", 0.3, current, readings)
    loop = 'hysteresis = { width = "0.2 mA", transition = "0.1 mA" }\nthreshold = "20 uA"'
    slow = 'driver_lag = "1 ms"\npilot_lag = "1 ms"\nspool_rate_limit = "1 A/s"'
    predictor = at_rest(tmp_path, f"{loop}\n{slow}", rows)
    unmoved = predictor.model.memory((), ())
    frozen = predictor.freeze(rows, *unmoved)
    effects = [c for c in candidates(predictor.model, ()) if examinable(c, predictor)]
    assert len(effects) > 10
    for effect in effects:
        residual, _ = predictor.innovations(frozen, *predictor.model.memory([effect], [1.0]))
        assert np.isfinite(residual).all(), effect.name
    quick = at_rest(tmp_path, loop, rows)
    assert np.array_equal(
        predictor.innovations(frozen, *unmoved)[0],
        quick.innovations(frozen, *quick.model.memory((), ()))[0],
    )
    unstated = at_rest(tmp_path, loop, rows)
    assert not {"driver_lag", "pilot_lag"} & {
        c.name for c in candidates(unstated.model, ()) if examinable(c, unstated)
    }


def test_a_sweep_needs_something_to_show(tmp_path: Path) -> None:
    """A current alone, and a flow without its pressure, are refused with what is lacking."""
    file = open_valve(tmp_path / "sweep.csv", 6e-3, 1, 0.0)
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    heads = file.read_text().splitlines()[0].split(",")
    fewer = recorded(tmp_path / "few.csv", dict(zip(heads[:3], rows.T[:3], strict=True)))
    result, output = asked("gap", SWEEP, [fewer], [], tmp_path)
    assert result["verdict"] == "cannot_examine"
    assert "few.csv has no pressure_a" in output
