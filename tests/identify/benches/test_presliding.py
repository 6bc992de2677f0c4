"""Friction that bends by millimetres before it slides, as that of a damper's pads.

The recordings integrate Dahl's law dz/dt = (v - |v| z)/d by Euler's method in steps of 0.1 ms.
"""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hil_emulator.identify.prediction.benches.presliding import Path as Motion
from hil_emulator.identify.prediction.benches.presliding import directions, distance_of
from tests.identify.benches.asked import asked, recorded

DISTANCE = 5.7e-3
FORCE = 5000.0
TIME = np.arange(0.0, 30.0, 1e-4)


def moved(kind: int) -> tuple[NDArray[np.float64], ...]:
    """Return position, velocity and acceleration of a damper that a machine moves."""
    sizes, turning = (0.014, 0.006), (0.17 + 0.05 * kind, 0.41)
    x, v, a = (np.zeros(len(TIME)) for _ in range(3))
    for size, hertz in zip(sizes, turning, strict=True):
        w = 2.0 * np.pi * hertz
        x += size * np.sin(w * TIME)
        v += size * w * np.cos(w * TIME)
        a -= size * w * w * np.sin(w * TIME)
    return x, v, a


def bent(velocity: NDArray[np.float64], distance: float) -> NDArray[np.float64]:
    """Return the direction of friction along a motion."""
    z = np.zeros(len(velocity))
    for k, v in enumerate(velocity[:-1]):
        z[k + 1] = z[k] + 1e-4 * (v - abs(v) * z[k]) / distance
    return z


def damper(file: Path, kind: int) -> Path:
    """Record position and force at 100 Hz."""
    random = np.random.default_rng(kind)
    x, v, a = moved(kind)
    dry = bent(v, DISTANCE)[::100]
    x, a = x[::100], a[::100]
    force = FORCE * dry + 20.0 * a
    return recorded(file, {
        "time [s]": TIME[::100],
        "position [mm]": 60.0 + 1e3 * x + random.normal(0.0, 5e-3, len(x)),
        "load_force [N]": force + random.normal(0.0, 25.0, len(x)),
    })  # fmt: skip


def test_friction_follows_the_path() -> None:
    """The closed form over each stroke is that of Dahl's differential equation, at any speed."""
    x, v, _ = moved(0)
    assert np.max(np.abs(directions(x, v, DISTANCE) - bent(v, DISTANCE))) < 1e-3


@pytest.mark.parametrize(("distance", "within"), [(DISTANCE, 0.06), (4e-4, 0.06), (0.0, 0.0)])
def test_the_distance_follows_from_the_force(distance: float, within: float) -> None:
    """The grid has steps of a tenth; without presliding the distance is 0, whatever else acts."""
    x, v, a = moved(1)
    dry = bent(v, distance) if distance else np.sign(v)
    noise = np.random.default_rng(0).normal(0.0, 0.02 * FORCE, len(x))
    force = FORCE * dry + 2e4 * v + 50.0 * a + 3e4 * x - 200.0 + noise
    rows = slice(None, None, 100)
    path = Motion(np.column_stack([x, v, a])[rows], force[rows])
    assert distance_of([path]) == pytest.approx(distance, rel=within)


@pytest.mark.slow
def test_dry_friction_of_a_damper_is_named(tmp_path: Path) -> None:
    """Force and presliding distance of 5.7 mm are the true ones, and nothing else is missing."""
    config = tmp_path / "damper.toml"
    config.write_text('[bench]\nkind = "driven axis"\n[load]\nmass = "20 kg"\n')
    files = [damper(tmp_path / f"damper{i}.csv", i) for i in range(3)]
    result, shown = asked("identify", config, files[:2], files[2:], tmp_path)
    assert "slides after a presliding_distance of" in shown
    (effect,) = result["effects"]
    assert effect["name"] == "coulomb_friction"
    assert effect["value"] == pytest.approx(FORCE, rel=0.005)
    parameter = result["parameters"]["friction_presliding_distance"]
    assert parameter["refitted"] == pytest.approx(DISTANCE, rel=0.01)
    assert not result["unknown"]
    assert not {"coulomb_friction", "stribeck_friction"} & set(result["unseen"])
