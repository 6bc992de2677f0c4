"""A recorded half second of the reference machine, made once."""

from pathlib import Path

import pytest
from recorded import TICKS, script
from rigs import bench, reference

from hil_emulator.recording.header import header
from hil_emulator.recording.journal import Recording, read
from hil_emulator.recording.recorder import FileRecorder


@pytest.fixture(scope="session")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the journal of half a second in which a sensor gets stuck for a while."""
    file = tmp_path_factory.mktemp("recording") / "run.rec"
    config = reference()
    with bench(config) as b:
        b.rig.recorder = FileRecorder([file], header(config, b.rig.nodes))
        b.rig.fault("pressure_a", "stuck", start="100 ms", duration="50 ms")
        for k in range(TICKS):
            b.tick(*script(k))
        b.rig.recorder.close()
    return file


@pytest.fixture(scope="session")
def recording(journal: Path) -> Recording:
    """Return that journal, read."""
    return read(journal)
