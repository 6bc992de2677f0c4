"""Recorded tables: units, order, and everything that can be wrong with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.data import experiments, load_experiments
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.reading import MeasuredFile, Series


def written(folder: Path, header: str, columns: list[np.ndarray]) -> Path:
    """Write a table."""
    file = folder / "log.csv"
    rows = np.column_stack(columns)
    lines = [header, *(",".join(f"{v:.9g}" for v in row) for row in rows)]
    file.write_text("\n".join(lines))
    return file


def only(file: Path) -> Experiment:
    """Read one experiment."""
    return load_experiments([file])[0]


TIME = np.arange(200) * 1e-3


def test_units_and_order_do_not_matter(tmp_path: Path) -> None:
    """A position in mm in any column becomes metres."""
    file = written(tmp_path, "position [mm],time [ms]", [TIME * 1e3, TIME * 1e3])
    read = only(file)
    assert read.period == pytest.approx(1e-3)
    assert read.readings["position"][-1] == pytest.approx(0.199)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("time [s],position [bar]", "a unit of m is wanted"),
        ("time [s],position", "has no unit"),
        ("time [s],positon [mm]", "did you mean position"),
        ("tim [s],position [mm]", 'no column "time [s]"'),
    ],
)
def test_a_wrong_header_is_named_with_its_remedy(tmp_path: Path, header: str, words: str) -> None:
    """A wrong dimension, a missing unit, a misspelt channel and a missing time get a message."""
    with pytest.raises(UserError, match=r"log\.csv") as caught:
        only(written(tmp_path, header, [TIME, TIME]))
    assert words in str(caught.value)


def test_ten_samples_are_too_few(tmp_path: Path) -> None:
    """Ten samples end in a message, not in a name."""
    with pytest.raises(UserError, match="10 usable samples"):
        only(written(tmp_path, "time [s],position [mm]", [TIME[:10], TIME[:10]]))


def test_a_gap_is_reported_and_not_filled(tmp_path: Path) -> None:
    """Half a second without samples stays empty on the grid."""
    time = np.concatenate([TIME, TIME + 0.7])
    read = only(written(tmp_path, "time [s],position [mm]", [time, time]))
    inside = read.readings["position"][300:600]
    assert not np.isfinite(inside).any()
    assert any("1 gap of" in note for note in read.notes)


def test_repeated_and_reversed_time_is_put_right_and_reported(tmp_path: Path) -> None:
    """Rows out of order are sorted; of repeated times the first stays."""
    time = TIME.copy()
    time[50], time[51] = time[51], time[50]
    time[101] = time[100]
    read = only(written(tmp_path, "time [s],position [mm]", [time, time * 1e3]))
    assert any("backwards" in note for note in read.notes)
    assert any("repeat" in note for note in read.notes)
    np.testing.assert_allclose(np.diff(read.readings["position"]), 1e-3, atol=1e-9)


def test_a_dead_channel_is_reported_and_left_out(tmp_path: Path) -> None:
    """A position that never moves is no data."""
    table = [TIME, TIME * 0.0, TIME * 100.0]
    read = only(written(tmp_path, "time [s],position [mm],load_force [N]", table))
    assert "position" not in read.readings
    assert any("position: constant" in note for note in read.notes)


def test_missing_cells_are_counted(tmp_path: Path) -> None:
    """Cells that hold no number become missing values."""
    file = written(tmp_path, "time [s],position [mm]", [TIME, TIME * 1e3])
    file.write_text(file.read_text().replace("0.1,100", "0.1,error"))
    read = only(file)
    assert any("position: 1 values are missing" in note for note in read.notes)


def test_an_irregular_clock_is_resampled_and_reported(tmp_path: Path) -> None:
    """Samples every 9 to 11 ms become a uniform grid of about 10 ms."""
    time = np.cumsum(np.random.default_rng(1).uniform(9e-3, 11e-3, 400))
    read = only(written(tmp_path, "time [s],position [mm]", [time, time * 1e3]))
    assert any("irregular" in note for note in read.notes)
    assert read.period == pytest.approx(0.01, rel=0.02)
    np.testing.assert_allclose(np.diff(read.readings["position"]), read.period, rtol=1e-6)


def test_a_clock_that_starts_again_makes_two_experiments(tmp_path: Path) -> None:
    """Two runs in one file are two experiments, whichever times they cover; rows are not merged."""
    for begin in (0.0, 0.1, -5.0):
        time = np.concatenate([TIME, TIME[:150] + begin])
        position = np.concatenate([TIME, 1.0 - TIME[:150]]) * 1e3
        file = written(tmp_path, "time [s],position [mm]", [time + 7.0, position])
        first, second = load_experiments([file])
        assert (first.name, second.name) == ("log.csv#1", "log.csv#2")
        np.testing.assert_allclose(first.readings["position"], TIME, atol=1e-9)
        np.testing.assert_allclose(second.readings["position"], 1.0 - TIME[:150], atol=1e-9)
        assert any("time starts again once" in note for note in first.notes)


def test_a_pause_in_which_the_set_point_got_lost_parts_experiments(tmp_path: Path) -> None:
    """The current in a pause is unknown, unless it is the same before and after.

    Without a set point (a bench of forces) a pause is only a gap.
    """
    time = np.concatenate([TIME[:100], TIME[130:]])
    moved, held = np.sin(7.0 * time), np.where(time < 0.05, 1.0, 2.0)
    heads = "time [s],valve_current [mA],position [mm]"
    first, second = load_experiments([written(tmp_path, heads, [time, moved, time])])
    assert (first.samples, second.samples) == (100, len(TIME) - 130)
    assert any("rows are missing for a while once" in note for note in first.notes)
    np.testing.assert_allclose(second.current, 1e-3 * moved[100:])
    assert only(written(tmp_path, heads, [time, held, time])).samples == len(TIME)
    assert only(written(tmp_path, "time [s],position [mm]", [time, time])).samples == len(TIME)
    later = time + np.where(time > 0.1, 1.0, 0.0)
    assert len(load_experiments([written(tmp_path, heads, [later, held, time])])) == 2


def test_pauses_that_leave_no_experiment_are_refused(tmp_path: Path) -> None:
    """40 rows between two pauses are too few."""
    kept = np.arange(len(TIME)) % 80 < 40
    file = written(
        tmp_path, "time [s],valve_current [mA],position [mm]",
        [TIME[kept], np.sin(7.0 * TIME[kept]), TIME[kept]],
    )  # fmt: skip
    with pytest.raises(UserError, match=r"rows are missing, .* no part has the 50"):
        load_experiments([file])


def test_a_short_rest_after_a_restart_is_left_out(tmp_path: Path) -> None:
    """Ten samples after the clock began again are no experiment; the first run is."""
    time = np.concatenate([TIME, TIME[:10]])
    (first,) = load_experiments([written(tmp_path, "time [s],position [mm]", [time, time])])
    assert first.samples == len(TIME)
    assert any("1 with less than 50 samples left out" in note for note in first.notes)


def test_a_clock_that_falls_back_a_little_starts_again(tmp_path: Path) -> None:
    """Ten rows whose times were there before belong to another run, not into this one."""
    time = np.concatenate([TIME, TIME[-1] - 0.01 + TIME[:150]])
    position = np.concatenate([TIME, 1.0 - TIME[:150]]) * 1e3
    first, second = load_experiments([written(tmp_path, "time [s],position [mm]",
                                              [time, position])])  # fmt: skip
    assert (first.samples, second.samples) == (len(TIME), 150)


def test_rows_in_disorder_are_one_experiment(tmp_path: Path) -> None:
    """Rows shuffled through and through come from one clock."""
    time = np.random.default_rng(1).permutation(TIME)
    (read,) = load_experiments([written(tmp_path, "time [s],position [mm]", [time, time * 1e3])])
    np.testing.assert_allclose(np.diff(read.readings["position"]), 1e-3, atol=1e-9)


@pytest.mark.parametrize("at", [200, 150, 0])
@pytest.mark.parametrize("stamp", [1.76e9, 86_400.0, 1e300, -1e300])
def test_a_row_with_a_wrong_time_is_left_out(tmp_path: Path, at: int, stamp: float) -> None:
    """Wherever it stands in the file: it is noted, and the others are one experiment."""
    time, position = np.insert(TIME, at, stamp), np.insert(TIME, at, 0.5) * 1e3
    for more in ({}, {"valve_current [mA]": np.sin(7.0 * time.clip(-1.0, 1.0))}):
        columns = {"time [s]": time, "position [mm]": position} | more
        e = only(written(tmp_path, ",".join(columns), list(columns.values())))
        assert e.samples == len(TIME)
        np.testing.assert_allclose(e.readings["position"], TIME, atol=1e-9)
        assert any("rows with a time far from all others, left out: 1" in n for n in e.notes)


def test_a_night_parts_a_log(tmp_path: Path) -> None:
    """Without a set point as with one, in order or not: the grid has no row of the pause."""
    order = np.random.default_rng(1).permutation(2 * len(TIME))
    time = np.concatenate([TIME, TIME + 86_400.0])
    for rows in (np.arange(len(time)), order):
        file = written(tmp_path, "time [s],position [mm]", [time[rows], time[rows] % 1e4 * 1e3])
        first, second = load_experiments([file])
        assert (first.samples, second.samples) == (len(TIME), len(TIME))
        np.testing.assert_allclose(second.readings["position"], TIME + 6_400.0, atol=1e-6)
        assert any("rows are missing for a while once" in note for note in first.notes)


def test_clocks_of_several_channels_pause_together(tmp_path: Path) -> None:
    """A pause of all of them parts them, one of a single channel does not."""
    slow = np.arange(0.0, TIME[-1], 0.01)
    far = Series(np.append(TIME, 1e9), np.append(TIME, 0.0))
    recording = MeasuredFile(
        tmp_path / "log.mf4",
        {"position": far, "load_force": Series(slow, slow)}, "", False, (),
    )  # fmt: skip
    (one,) = experiments(recording)
    assert one.samples == len(TIME)
    both = {
        "position": Series(np.concatenate([TIME, TIME + 1e5]), np.tile(TIME, 2)),
        "load_force": Series(np.concatenate([slow, slow + 1e5]), np.tile(slow, 2)),
    }
    assert [e.samples for e in experiments(replace(recording, series=both))] == [len(TIME)] * 2


def test_times_that_hardly_any_sample_has_are_refused(tmp_path: Path) -> None:
    """Pauses too short to part a log may still be too many for a grid."""
    bursts = np.concatenate([np.arange(3) * 1e-3 + 50.0 * i for i in range(60)])
    file = written(tmp_path, "time [s],position [mm]", [bursts, bursts])
    with pytest.raises(UserError, match=r"180 samples over .* periods of 1 ms"):
        load_experiments([file])
