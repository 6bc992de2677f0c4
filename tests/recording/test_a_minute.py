"""A minute at 1 kHz: the same values in every tool, and what it costs the loop."""

from pathlib import Path

import asammdf
import can
import cantools
import numpy as np
import pandas as pd
import pytest
from rigs import START, bench, reference, set_point

from hil_emulator.recording.header import header
from hil_emulator.recording.journal import read
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.simulation.clock import LockStep
from hil_emulator.simulation.loop import Timing, run

TICKS = 60_000


@pytest.mark.full(
    sibling="recording/test_exports.py::test_cantools_decodes_what_the_sensors_reported"
)
def test_a_minute_is_the_same_in_all_tools(tmp_path: Path) -> None:
    """All columns in asammdf and pandas, the PDOs decoded by cantools from BLF."""
    files = [tmp_path / f"run.{ending}" for ending in ("rec", "mf4", "parquet", "blf")]
    config = reference()
    with bench(config) as b:
        b.rig.recorder = recorder = FileRecorder(files, header(config, b.rig.nodes))
        timing = Timing()
        for k in range(TICKS):
            b.peer.send([START] if k == 5 else [set_point(np.sin(k * 0.01))])
            run(b.rig, LockStep(), 1, timing)
            b.peer.receive()
        recorder.close()
    recording = read(files[0])
    assert recording.rows.shape[0] == TICKS
    assert recording.rows.shape[1] >= 30
    assert pd.read_parquet(files[2]).to_numpy().tobytes() == recording.rows.tobytes()
    with asammdf.MDF(files[1]) as mdf:
        for name, values in recording.table().items():
            if name != "time":
                assert mdf.get(name).samples.tobytes() == values.tobytes()
    database = cantools.database.load_file(files[3].with_suffix(".dbc"))
    with can.LogReader(str(files[3])) as reader:
        decoded = [
            database.decode_message(m.arbitration_id, m.data)["position"]
            for m in reader
            if m.arbitration_id == 0x285
        ]
    positions = recording.table()["position"][-len(decoded) :]
    assert len(decoded) == TICKS - 6
    np.testing.assert_allclose(decoded, positions, rtol=0, atol=0.501e-7)
