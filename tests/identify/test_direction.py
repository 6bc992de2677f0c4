"""In which direction a position counts, on rigs that a machine or a drive moves.

The logs follow from Newton's law: F = m a + c x + W + sign(v) (F_c + F_s exp(-|v|/v_s)).
"""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from hil_emulator.identify.data_checks.direction import dissipative
from hil_emulator.identify.measured.experiment import Experiment

PERIOD = 0.01
MASS = 20.0
NO_CYLINDER = {"cylinder_piston_area": 0.0, "cylinder_area_ratio": 1.0, "tank_pressure": 1e5}
PLUNGER = {"cylinder_piston_area": 5e-4, "cylinder_area_ratio": 0.0, "tank_pressure": 1e5}

ONE_WAY = {"ways": 1}
FRICTION = {"coulomb": 30.0, "stribeck": 10.0}
CASES: dict[str, tuple[dict[str, float], bool, str]] = {
    "friction": (FRICTION, False, ""),
    "one way": (FRICTION | ONE_WAY, False, ""),
    "one way, less friction at speed": ({"coulomb": 2.0, "stribeck": 60.0} | ONE_WAY, False, ""),
    "a spring": (FRICTION | {"spring": 5e4}, False, ""),
    "a weight": (FRICTION | {"weight": -500.0}, False, ""),
    "one way, driven by a weight": (FRICTION | ONE_WAY | {"weight": -80.0}, False, "one way only"),
    "against extension": (FRICTION, True, "reversed"),
    "against extension, with a spring": (FRICTION | {"spring": 5e4}, True, "reversed"),
    "against extension, one way": (FRICTION | ONE_WAY, True, "one way only"),
    "against extension, with a ripple": (FRICTION | {"ripple": 60.0}, True, "not far more"),
}
"""Forces of a log, whether its position counts against extension, and the words of a note."""


def moved(ways: float) -> tuple[NDArray[np.float64], ...]:
    """Return time, position, velocity and acceleration over 20 s, to and fro or one way."""
    time = np.arange(0.0, 20.0, PERIOD)
    w, size = (1.9, 0.02) if ways > 1 else (1.5, 0.004)
    drift = 0.0 if ways > 1 else 0.009
    x = size * np.sin(w * time) + drift * time
    v = size * w * np.cos(w * time) + drift
    return time, x, v, -size * w * w * np.sin(w * time)


def recorded(forces: Mapping[str, float], turned: bool, driven: bool, seed: int = 1) -> Experiment:
    """Return a log of a rig with some forces."""
    f = {"ways": 2, "coulomb": 0.0, "stribeck": 0.0, "spring": 0.0, "weight": 0.0, "ripple": 0.0}
    f |= forces
    _, x, v, a = moved(f["ways"])
    random = np.random.default_rng(seed)
    dry = np.sign(v) * (f["coulomb"] + f["stribeck"] * np.exp(-np.abs(v) / 4e-3))
    drive = MASS * a + f["spring"] * x + f["weight"] + dry + f["ripple"] * np.sin(900.0 * x)
    force = drive + random.normal(0.0, 0.5, len(x))
    readings = {"position": 0.1 + (-x if turned else x) + random.normal(0.0, 5e-6, len(x))}
    if driven:
        return Experiment("axis", PERIOD, np.zeros(0), readings | {"load_force": force})
    pressure = 8e5 + 2e4 * np.sign(v)
    readings |= {"pressure_a": pressure, "load_force": 4.8e-4 * pressure - force}
    return Experiment("seal", PERIOD, np.zeros(0), readings)


@pytest.mark.parametrize("driven", [True, False])
@pytest.mark.parametrize(("forces", "turned", "note"), CASES.values(), ids=CASES.keys())
def test_a_position_is_reversed_only_if_friction_requires_it(
    forces: dict[str, float], turned: bool, note: str, driven: bool
) -> None:
    """A log that moves one way only never reverses a position; a doubt is a note."""
    log = recorded(forces, turned, driven)
    if not driven and forces.get("ways") == 1:
        # a plunger's area is uncertain by more than its friction
        log.readings["load_force"] += 2e-5 * log.readings["pressure_a"]
    (checked,) = dissipative([log], NO_CYLINDER if driven else PLUNGER, driven)
    changed = not np.array_equal(checked.readings["position"], log.readings["position"])
    assert changed == (note == "reversed")
    assert len(checked.notes) == (note != "")
    assert all(note in text for text in checked.notes)


def test_logs_that_move_both_ways_decide_for_the_others() -> None:
    """All logs of a rig count the position in one direction."""
    both, single = (recorded(FRICTION | way, True, True) for way in ({}, ONE_WAY))
    assert all("; reversed" in e.notes[-1] for e in dissipative([single, both], NO_CYLINDER, True))
