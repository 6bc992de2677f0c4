"""Time that a recording to a file takes in a tick."""

import tempfile
import time
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.frame import Frame
from hil_emulator.recording.header import header
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.simulation.rig import Rig

_TICKS = 3_000
_HEARD = [Frame(0x200, bytes(4)), Frame(0x080)]  # a set point and a SYNC
_SENT = [Frame(0x180 + i, bytes(8)) for i in range(4)]


def measure_recording(config: Configuration, rig: Rig) -> dict[str, float]:
    """Return p50 and p99 of the loop's time for its recording in a tick [us].

    The CPU time of this thread is measured: the writer's process and other programs do not count.
    """
    spent = []
    with tempfile.TemporaryDirectory() as folder:
        recorder = FileRecorder([Path(folder) / "run.rec"], header(config, rig.nodes))
        values = list(rig.sensors.reading)
        for now_ns in range(0, _TICKS * rig.tick_ns, rig.tick_ns):
            begin = time.thread_time_ns()
            recorder.bus(now_ns, _HEARD, sent=False)
            recorder.bus(now_ns, _SENT, sent=True)
            recorder.row(now_ns, rig.plant, values)
            spent.append(time.thread_time_ns() - begin)
        recorder.close()
    p50, p99 = np.percentile(spent, (50, 99)) * 1e-3
    return {"p50": float(p50), "p99": float(p99)}
