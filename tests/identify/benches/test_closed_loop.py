"""An actuator in its position loop, of which the reference was recorded and no current.

The recordings follow from equations of their own: orifices that creep where narrow, two chambers, a
mass with viscous friction, a spool of second order, integrated by Euler's method in 4 us steps.
"""

from pathlib import Path

import numba
import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import REFERENCE, Experiment
from hil_emulator.identify.prediction.benches.position_loop import estimated_gain
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.platform.paths import cache_folder
from tests.identify.benches.asked import asked, bench, names, recorded
from tests.identify.benches.valve import CREEPING, GAIN, Array, noisy

LOOP = bench("closed_loop")
PROPORTIONAL = 0.2
OVERLAP = 1e-4
PERIOD = 1e-3


@numba.njit
def orifice(opening: float, drop: float) -> float:
    """Return the flow through an edge [m^3/s]."""
    if opening <= 0.0 or drop == 0.0:
        return 0.0
    turbulent, creeping = GAIN * opening * np.sqrt(abs(drop)), CREEPING * opening**2 * abs(drop)
    return np.sign(drop) * turbulent * creeping / (turbulent**4 + creeping**4) ** 0.25


@numba.njit
def moved(reference: Array, noise: Array, lap: float) -> Array:
    """Return position read, both pressures, and the force on the load, a row per millisecond."""
    area, ratio, mass, modulus, dead, stroke = 2.0106e-4, 0.61, 50.0, 1.3e9, 3e-6, 0.08
    w, step = 2.0 * np.pi * 250.0, 4e-6
    u, du, x, v = 0.0, 0.0, 0.04, 0.0
    a, b = ratio * 160e5 / (1.0 + ratio), 160e5 / (1.0 + ratio)
    rows = np.zeros((len(reference), 4))
    for k in range(len(reference)):
        force = area * (a - ratio * b) - 1000.0 * v
        rows[k] = x + noise[k], a, b, force
        current = PROPORTIONAL * (reference[k] - rows[k, 0])
        for _ in range(round(PERIOD / step)):
            into = orifice(u - lap, 160e5 - a) - orifice(-u - lap, a - 1e5)
            out = orifice(u - lap, b - 1e5) - orifice(-u - lap, 160e5 - b)
            a += step * modulus / (dead + area * x) * (into - area * v)
            b += step * modulus / (dead + ratio * area * (stroke - x)) * (ratio * area * v - out)
            du += step * (w * w * (current - u) - 1.4 * w * du)
            u += step * du
            v += step * (area * (a - ratio * b) - 1000.0 * v) / mass
            x += step * v
    return rows


def ramps(random: np.random.Generator) -> Array:
    """Return three seconds of ramps between random positions [m]."""
    places = 0.04 + random.uniform(-0.006, 0.006, 16)
    places[0] = 0.04  # at rest; a jump would empty a chamber, which these equations do not know
    return np.interp(np.arange(0.0, 3.0, PERIOD), 0.2 * np.arange(16), places)


def looped(file: Path, seed: int, lap: float) -> Path:
    """Record a loop that follows ramps."""
    random = np.random.default_rng(seed)
    reference = ramps(random)
    time = PERIOD * np.arange(len(reference))
    rows = moved(reference, random.normal(0.0, 1e-5, len(time)), lap)
    return recorded(file, {
        "time [s]": time, "position_reference [mm]": 1e3 * reference,
        "position [mm]": 1e3 * rows.T[0],
        "pressure_a [bar]": noisy(1e-5 * rows.T[1], 0.1, file),
        "pressure_b [bar]": noisy(1e-5 * rows.T[2], 0.1, file),
        "load_force [N]": noisy(rows.T[3], 5.0, file),
    })  # fmt: skip


def free_loop(folder: Path) -> Path:
    """Return a configuration of a loop with an unknown gain."""
    free = folder / "free.toml"
    free.write_text(LOOP.read_text().replace('"0.2 A/m"', '"free"'))
    return free


@pytest.mark.full(sibling="test_a_dead_band_is_named")
def test_a_loop_as_configured_agrees(tmp_path: Path) -> None:
    """The loop's current is known from reference, position and gain."""
    file = looped(tmp_path / "loop.csv", 1, 0.0)
    result, output = asked("gap", LOOP, [file], [], tmp_path)
    assert "bench     a closed loop" in output
    assert "gain 0.2 A/m" in output
    assert result["verdict"] == "agrees"


@pytest.mark.slow
@pytest.mark.parametrize("lap", [0.0, OVERLAP])
def test_a_gain_follows_from_flow_and_deviation(lap: float) -> None:
    """Edges that creep where narrow do not bend it, nor does a dead band."""
    random = np.random.default_rng(1)
    reference = ramps(random)
    rows = moved(reference, random.normal(0.0, 1e-5, len(reference)), lap)
    readings = {REFERENCE: reference, "position": rows.T[0], "pressure_a": rows.T[1]}
    plant = PlantModel(load([LOOP]), cache_folder()).plant_values
    gain = estimated_gain([Experiment("loop", PERIOD, np.zeros(0), readings)], plant)
    assert gain == pytest.approx(PROPORTIONAL, rel=0.01)


@pytest.mark.full(sibling="test_a_gain_follows_from_flow_and_deviation")
def test_a_free_gain_is_found(tmp_path: Path) -> None:
    """`gap` states the gain that fits, and that model and measurement agree with it."""
    file = looped(tmp_path / "loop.csv", 1, 0.0)
    result, output = asked("gap", free_loop(tmp_path), [file], [], tmp_path)
    assert result["verdict"] == "agrees"
    gain = float(output.partition("proportional gain: ")[2].split()[0])
    assert gain == pytest.approx(PROPORTIONAL, rel=0.01)


@pytest.mark.slow
def test_a_dead_band_is_named(tmp_path: Path) -> None:
    """An overlap of 0.1 mA is a dead band of 0.5 mm in the loop, whose gain is unknown."""
    files = [looped(tmp_path / f"{i}.csv", i, OVERLAP) for i in range(3)]
    result, _ = asked("identify", free_loop(tmp_path), files[:2], files[2:], tmp_path)
    assert names(result) == ["overlap"]
    assert result["effects"][0]["value"] == pytest.approx(OVERLAP, rel=0.1)


def test_a_loop_without_a_reference_is_refused(tmp_path: Path) -> None:
    """Nobody knows what commands it, and the message names the channel."""
    file = looped(tmp_path / "loop.csv", 1, 0.0)
    text = file.read_text().replace("position_reference [mm]", "wanted [mm]")
    file.write_text(text)
    result, _ = asked("gap", LOOP, [file], [], tmp_path)
    assert result["verdict"] == "cannot_examine"
    assert "lacks position_reference" in result["reason"]
