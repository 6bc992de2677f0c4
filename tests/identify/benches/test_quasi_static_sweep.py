"""A servo valve in a sweep of minutes, of which nothing but its rating is configured."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.boundary import bounded, with_values
from hil_emulator.identify.prediction.benches.sweep_bench import sweep_bench
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


def test_a_sweep_needs_something_to_show(tmp_path: Path) -> None:
    """A current alone, and a flow without its pressure, are refused with what is lacking."""
    file = open_valve(tmp_path / "sweep.csv", 6e-3, 1, 0.0)
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    heads = file.read_text().splitlines()[0].split(",")
    fewer = recorded(tmp_path / "few.csv", dict(zip(heads[:3], rows.T[:3], strict=True)))
    result, output = asked("gap", SWEEP, [fewer], [], tmp_path)
    assert result["verdict"] == "cannot_examine"
    assert "few.csv has no pressure_a" in output
