"""Tables of every format give the same experiment; one message names what is missing."""

import sys
from collections.abc import Callable
from pathlib import Path

import asammdf
import numpy as np
import pandas as pd
import pyarrow
import pyarrow.parquet
import pytest

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.data import load_experiments
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.formats import measurement_data, own_process, parquet

TIME = np.arange(400) * 1e-3
POSITION = 40.0 + np.sin(20.0 * TIME)
PRESSURE = 60.0 + np.cos(20.0 * TIME)
CURRENT = np.repeat([1.0, -1.0], 200)


def check(read: Experiment) -> None:
    """Compare with what was written in mm, bar and mA."""
    assert read.period == pytest.approx(1e-3)
    np.testing.assert_allclose(read.readings["position"], POSITION * 1e-3, rtol=1e-9)
    np.testing.assert_allclose(read.readings["pressure_a"], PRESSURE * 1e5, rtol=1e-9)
    np.testing.assert_allclose(read.current, CURRENT * 1e-3, rtol=1e-9)


def mdf(file: Path, *groups: list[asammdf.Signal]) -> Path:
    """Write an MDF file with a time base for each group."""
    with asammdf.MDF(version="4.10") as out:
        for group in groups:
            out.append(group, common_timebase=True)
        out.save(file, overwrite=True)
    return file


def signal(values: np.ndarray, name: str, unit: str, time: np.ndarray = TIME) -> asammdf.Signal:
    """Return one channel of an MDF file."""
    return asammdf.Signal(values.copy(), time, name=name, unit=unit)


def test_mdf_brings_its_own_units(tmp_path: Path) -> None:
    """Channels of one MDF group, each with its unit."""
    file = mdf(
        tmp_path / "log.mf4",
        [
            signal(POSITION, "position", "mm"),
            signal(PRESSURE, "pressure_a", "bar"),
            signal(CURRENT, "valve_current", "mA"),
        ],
    )
    check(load_experiments([file])[0])


def test_parquet_names_units_in_its_columns(tmp_path: Path) -> None:
    """A table of pandas whose columns are called like the header of a CSV."""
    file = tmp_path / "log.parquet"
    pd.DataFrame(
        {"time [s]": TIME, "position [mm]": POSITION, "pressure_a [bar]": PRESSURE,
         "valve_current [mA]": CURRENT, "remark": ["x"] * len(TIME)}
    ).to_parquet(file)  # fmt: skip
    check(load_experiments([file])[0])


def test_parquet_with_units_of_its_columns(tmp_path: Path) -> None:
    """The unit may stand in the metadata of the field, and time may be a date."""
    fields = [
        pyarrow.field("time", pyarrow.timestamp("ns")),
        pyarrow.field("position", pyarrow.float64(), metadata={"unit": "mm"}),
        pyarrow.field("pressure_a", pyarrow.float32(), metadata={"unit": "bar"}),
        pyarrow.field("valve_current", pyarrow.int64(), metadata={"unit": "mA"}),
    ]
    dates = pd.Timestamp("2026-03-04 05:06:07") + pd.to_timedelta(np.arange(400), unit="ms")
    arrays = [
        pyarrow.array(dates, fields[0].type), pyarrow.array(POSITION),
        pyarrow.array(PRESSURE.astype(np.float32)), pyarrow.array(CURRENT.astype(np.int64)),
    ]  # fmt: skip
    file = tmp_path / "log.parquet"
    pyarrow.parquet.write_table(pyarrow.table(arrays, schema=pyarrow.schema(fields)), file)
    read = load_experiments([file])[0]
    assert read.period == pytest.approx(1e-3)
    np.testing.assert_allclose(read.readings["pressure_a"], PRESSURE * 1e5, rtol=1e-6)
    np.testing.assert_allclose(read.current, CURRENT * 1e-3)


def test_mdf_groups_of_different_rates_share_the_fastest_grid(tmp_path: Path) -> None:
    """A channel every 10 ms has a value at every tenth sample, and no value in between."""
    slow = TIME[::10]
    file = mdf(
        tmp_path / "log.mf4",
        [signal(PRESSURE, "pressure_a", "bar"), signal(CURRENT, "valve_current", "mA")],
        [signal(POSITION[::10], "position", "mm", slow)],
    )
    read = load_experiments([file])[0]
    position = read.readings["position"]
    assert np.flatnonzero(np.isfinite(position)).tolist() == list(range(0, 400, 10))
    np.testing.assert_allclose(position[::10], POSITION[::10] * 1e-3)
    assert any("position: a sample every 10 ms" in note for note in read.notes)


def test_mdf_groups_of_the_same_rate_and_another_phase_are_interpolated(tmp_path: Path) -> None:
    """Two rasters of 1 ms, half a period apart, come onto one."""
    shifted = TIME + 0.5e-3
    other = 40.0 + np.sin(20.0 * shifted)
    file = mdf(
        tmp_path / "log.mf4",
        [signal(PRESSURE, "pressure_a", "bar"), signal(CURRENT, "valve_current", "mA")],
        [signal(other, "position", "mm", shifted)],
    )
    inside = load_experiments([file])[0].readings["position"][1:-1]
    np.testing.assert_allclose(inside, POSITION[1:-1] * 1e-3, atol=1e-7)


def test_groups_without_a_common_time_have_two_clocks(tmp_path: Path) -> None:
    """One group counts from zero, the other from 1970: nothing is guessed."""
    file = mdf(
        tmp_path / "log.mf4",
        [signal(PRESSURE, "pressure_a", "bar")],
        [signal(POSITION, "position", "mm", TIME + 1.7e9)],
    )
    with pytest.raises(UserError, match=r"no time in common.*two clocks"):
        load_experiments([file])


def test_another_name_of_a_channel_can_be_stated(tmp_path: Path) -> None:
    """A logger's own names are mapped to channels."""
    file = mdf(tmp_path / "log.mf4", [signal(POSITION, "CylPos", "mm")])
    read = load_experiments([file], {"CylPos": "position"})[0]
    np.testing.assert_allclose(read.readings["position"], POSITION * 1e-3)
    with pytest.raises(UserError, match="no column is called Rod; its columns are CylPos"):
        load_experiments([file], {"Rod": "position"})
    with pytest.raises(UserError, match="no channel is called posn"):
        load_experiments([file], {"CylPos": "posn"})


@pytest.mark.parametrize(("read", "package"), [(measurement_data.read, "asammdf"),
                                               (parquet.read, "pyarrow")])  # fmt: skip
def test_a_missing_package_is_named_with_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: Callable[[Path], object], package: str
) -> None:
    """Without the optional package there is one message, with what to install."""
    file = tmp_path / "log"
    file.write_bytes(b"something")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UserError, match=r"pip install 'hil-emulator\[recording\]'") as caught:
        read(file)
    assert package in str(caught.value)


@pytest.mark.parametrize("ending", [".mf4", ".parquet", ".npz"])
@pytest.mark.parametrize("content", [b"", b"MDF     4.10    rubbish", b"PAR1 and more rubbish"])
def test_a_damaged_file_is_refused(tmp_path: Path, ending: str, content: bytes) -> None:
    """Any damage gives one message that names the file."""
    file = tmp_path / f"log{ending}"
    file.write_bytes(content)
    with pytest.raises(UserError, match=r"log\."):
        load_experiments([file])


def test_a_file_that_ends_its_reader_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A segmentation fault in native code is one message here, and nothing else."""
    dying = tmp_path / "python"
    dying.write_text("#!/bin/sh\nkill -SEGV $$\n")
    dying.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(dying))
    with pytest.raises(UserError, match=r"log\.mf4: is not readable: it ends the process"):
        own_process.read("measurement_data", tmp_path / "log.mf4")


def test_fast_data_are_averaged(tmp_path: Path) -> None:
    """A log at 10 kHz becomes 1 kHz, with a third of its noise."""
    time = np.arange(20000) * 1e-4
    noise = np.random.default_rng(2).normal(0.0, 1.0, len(time))
    file = mdf(tmp_path / "log.mf4", [signal(noise, "pressure_a", "bar", time)])
    read = load_experiments([file])[0]
    assert read.period == pytest.approx(1e-3)
    assert np.std(read.readings["pressure_a"]) == pytest.approx(1e5 / np.sqrt(10.0), rel=0.05)
    assert any("10 kHz; averaged" in note for note in read.notes)
