"""Samples that no sensor saw are found, counted and left out; real steps and impacts stay."""

from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.measured.bad_samples import without_bad_samples
from hil_emulator.identify.measured.reading import Series
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from tests.identify.rig_data import INSTRUMENTS, knee, knee_model, recorded

Readings = dict[str, np.ndarray]


@cache
def moving() -> Readings:
    """Return what a rod shows that follows sines."""
    return recorded({}, "multisine", 1, 5.0).readings


@cache
def stopping() -> Readings:
    """Return what a rod shows that is driven into both stops, back and forth, in 4 s."""
    model = knee_model()
    plant = Plant(model.kernel, dict(model.plant_values), 2e-5)
    ideal = {
        "noise_sigma",
        "resolution_step",
    }  # a load cell without limits, whose force is not clipped
    chain = {c: {n: x for n, x in v.items() if n in ideal} for c, v in knee().sensors.items()}
    sensors = Sensors(model.kernel, chain, 1e-3, np.random.default_rng(1))
    rows = []
    for k in range(4000):
        sensors.sample(plant.signal_vector, plant.path)
        rows.append(sensors.reading.copy())
        plant.command({"valve_current": 8e-3 if k % 1000 < 500 else -8e-3})
        plant.step(50)
    table = np.array(rows)
    return {n: table[:, sensors.names.index(n)] for n in INSTRUMENTS}


def cleaned(readings: Readings, period: float = 1e-3) -> tuple[Readings, list[str]]:
    """Return readings without bad samples, and the notes."""
    time = np.arange(len(next(iter(readings.values())))) * period
    notes: list[str] = []
    kept = without_bad_samples({n: Series(time, v) for n, v in readings.items()}, notes)
    return {n: s.values for n, s in kept.items()}, notes


@pytest.mark.parametrize("every", [1, 2, 5, 10, 20])
def test_sound_data_keep_every_sample(every: int) -> None:
    """Of sines, steps and hard stops, at 1 kHz and as slow as 50 Hz, no sample is a bad one."""
    assert np.ptp(stopping()["position"]) > 0.078  # it does reach both stops
    for readings in (moving(), recorded({}, "steps", 2).readings, stopping()):
        slow = {n: v[::every] for n, v in readings.items()}
        kept, notes = cleaned(slow, every * 1e-3)
        assert notes == []
        for name, values in slow.items():
            np.testing.assert_array_equal(kept[name], values)


@pytest.mark.parametrize(("channel", "level", "words"), [
    ("load_force", 1e4, "10 kN"), ("position", 0.0, "0 mm"), ("pressure_a", 0.0, "0 bar"),
    ("pressure_b", 400e5, "400 bar"),
])  # fmt: skip
def test_half_a_percent_at_one_value_is_left_out(channel: str, level: float, words: str) -> None:
    """Every sample at a rail is missing afterwards, and no other; the note counts them."""
    rows = np.sort(np.random.default_rng(3).choice(5000, 25, replace=False))
    values = moving()[channel].copy()
    values[rows] = level
    kept, notes = cleaned(moving() | {channel: values})
    assert np.flatnonzero(np.isnan(kept[channel])).tolist() == rows.tolist()
    (note,) = notes
    assert note.startswith(f"{channel}: 25 of 5000 samples")
    assert f"{rows[0] * 1e-3:.4g}, " in note


def test_a_set_point_goes_on_through_a_bad_value() -> None:
    """The valve received a value near those before and after the wrongly logged one."""
    current = 1e-3 * np.sin(2.0 * np.pi * 3.0 * 1e-3 * np.arange(5000))
    rows = np.arange(100, 5000, 700)
    values = current.copy()
    values[rows] = 1.7
    kept, notes = cleaned({"valve_current": values})
    np.testing.assert_allclose(kept["valve_current"], current, atol=1e-6)
    assert "the line between the others" in notes[0]


def test_bad_positions_that_hide_each_other_are_left_out() -> None:
    """Two zeros around a good sample are two bad samples; the good one stays."""
    values = moving()["position"].copy()
    values[[324, 326]] = 0.0
    kept, notes = cleaned(moving() | {"position": values})
    assert np.flatnonzero(np.isnan(kept["position"])).tolist() == [324, 326]
    assert len(notes) == 1


def test_positions_that_no_rod_can_take_are_left_out() -> None:
    """Random places for one sample: whichever is farther off than the rod moves in five samples."""
    random = np.random.default_rng(4)
    rows = np.sort(random.choice(np.arange(10, 4990, 20), 25, replace=False))
    position = moving()["position"]
    values = position.copy()
    values[rows] += random.choice([-1.0, 1.0], 25) * random.uniform(5e-3, 20e-3, 25)
    kept, _ = cleaned(moving() | {"position": values})
    assert np.flatnonzero(np.isnan(kept["position"])).tolist() == rows.tolist()


def test_rows_written_twice_are_left_out() -> None:
    """A row in which every channel repeats its noise was written twice."""
    index = np.arange(5000)
    rows = np.arange(100, 5000, 200)
    index[rows] -= 1
    sound = {n: v + 1e-9 * np.abs(v) * np.random.default_rng(1).standard_normal(5000)
             for n, v in moving().items()}  # fmt: skip
    kept, notes = cleaned({n: v[index] for n, v in sound.items()})
    for values in kept.values():
        assert np.flatnonzero(np.isnan(values)).tolist() == rows.tolist()
    assert "25 of 5000 samples" in notes[0]
    assert "repeat the row before" in notes[0]
