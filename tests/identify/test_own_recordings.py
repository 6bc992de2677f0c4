"""The emulator's own recordings: the same experiment from every format that it writes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from rigs import START, bench, reference, set_point

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.recording import journal
from hil_emulator.recording.exports import export
from hil_emulator.recording.header import header
from hil_emulator.recording.journal import MAGIC, Recording

TICKS = 300
CHANNELS = ("pressure_a", "pressure_b", "position", "load_force")


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Return a run with another set point in each tick."""
    random = np.random.default_rng(5)
    config = reference()
    with bench(config) as rig:
        rig.ticks(2)
        rig.tick(START)
        for _ in range(TICKS):
            rig.tick(set_point(random.uniform(-2.0, 2.0)))
        head = header(config, rig.rig.nodes)
        return Recording(head, rig.recorder.rows(), list(rig.recorder.frames), [])


def read(recording: Recording, file: Path) -> Experiment:
    """Write the recording in the format of a file's ending, and read that."""
    source = file.with_suffix(".rec")
    journal.write(recording, source)
    if file != source:
        export(source, file)
    (experiment,) = experiments([file], reference(), Meaning())
    return experiment


@pytest.mark.parametrize("ending", [".rec", ".csv", ".npz", ".parquet", ".mf4", ".mat"])
def test_a_set_point_acts_after_the_readings_before_it(
    recording: Recording, tmp_path: Path, ending: str
) -> None:
    """A row holds what acted before its readings, whatever the format."""
    experiment = read(recording, tmp_path / f"run{ending}")
    table = recording.table()
    assert experiment.period == pytest.approx(1e-3)
    np.testing.assert_allclose(experiment.current[:-1], table["valve_current"][1:], rtol=1e-8)
    for name in CHANNELS:
        np.testing.assert_allclose(experiment.readings[name], table[name], rtol=1e-8)
    assert not any(name.startswith("model.") for name in experiment.readings)


@given(
    first=st.integers(0, 200), count=st.integers(60, 100), scale=st.floats(0.1, 1.5),
    channel=st.sampled_from(CHANNELS), missing=st.booleans(),
)  # fmt: skip
@settings(
    max_examples=3, deadline=None, phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
def test_every_format_gives_the_same_experiment(
    recording: Recording, tmp_path_factory: pytest.TempPathFactory, first: int, count: int,
    scale: float, channel: str, missing: bool,
) -> None:  # fmt: skip
    """Any part of a run, with any size of a reading and with missing ones, gives one experiment.

    So every format gives the same verdict: nothing else of a file is examined.
    """
    rows = recording.rows[first : first + count].copy()
    column = list(recording.units).index(channel)
    rows[:, column] *= scale
    rows[3, column] = np.nan if missing else rows[3, column]
    part = replace(recording, rows=rows, frames=[])
    endings = (".rec", ".csv", ".npz", ".parquet", ".mf4", ".mat")
    folder = tmp_path_factory.mktemp("part")
    one, *others = (read(part, folder / f"{ending[1:]}{ending}") for ending in endings)
    for other in others:
        assert other.period == pytest.approx(one.period)
        np.testing.assert_allclose(other.current, one.current, rtol=1e-8)
        assert other.readings.keys() == one.readings.keys()
        for name, values in one.readings.items():
            np.testing.assert_allclose(other.readings[name], values, rtol=1e-8)


@pytest.mark.parametrize("ending", [".blf", ".asc", ".log", ".pcapng"])
def test_frames_that_it_has_recorded_itself(
    recording: Recording, tmp_path: Path, ending: str
) -> None:
    """Frames converted from a journal are a capture like any other."""
    experiment = read(recording, tmp_path / f"run{ending}")
    table = recording.table()
    rows = experiment.samples
    assert rows >= TICKS
    wanted = table["position"][-rows:]
    np.testing.assert_allclose(experiment.readings["position"], wanted, rtol=0.0, atol=0.51e-7)
    np.testing.assert_allclose(
        experiment.current[:-1], table["valve_current"][-rows + 1 :], atol=1e-9
    )


def test_a_damaged_journal_is_refused(tmp_path: Path) -> None:
    """One message that names the file."""
    file = tmp_path / "run.rec"
    file.write_bytes(MAGIC)
    with pytest.raises(UserError, match=r"run\.rec: empty"):
        experiments([file], reference(), Meaning())
    file.write_bytes(b"HILREC9\n")
    with pytest.raises(UserError, match=r"run\.rec: of another version"):
        experiments([file], reference(), Meaning())
    file.write_bytes(b"something else")
    with pytest.raises(UserError, match=r"run\.rec: not a recording"):
        experiments([file], reference(), Meaning())
