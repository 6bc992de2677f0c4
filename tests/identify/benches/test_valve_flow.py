"""A servo valve on a flow bench: spool and metering edges, and nothing behind the ports.

The spool of the recordings is a linear second-order system, solved exactly by scipy.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from tests.identify.benches.asked import asked, bench, names, recorded
from tests.identify.benches.valve import LITRES, noisy, open_port

FLOW = bench("valve_flow")
OVERLAP = 1.5e-4


def metered(file: Path, seed: int, lap: float) -> Path:
    """Record two seconds of a current that steps at random every 20 ms."""
    time = np.arange(0.0, 2.0, 1e-3)
    steps = np.random.default_rng(seed).uniform(-2e-3, 2e-3, 100)
    current = steps[(time / 0.02 + 1e-9).astype(int) % 100]
    w = 2.0 * np.pi * 250.0
    fine = np.arange(0.0, 2.0, 1e-5)
    # each value acts from its sample to the next
    held = np.repeat(current, 100)[: len(fine)]
    _, spool, _ = lsim(([w * w], [1.0, 1.4 * w, w * w]), held, fine, interp=False)
    pressure = 80e5 + 5e5 * np.sin(2.0 * np.pi * time / 0.31)
    return recorded(file, {
        "time [s]": time, "valve_current [mA]": 1e3 * current,
        "flow_a [l/min]": noisy(LITRES * open_port(spool[::100], pressure, lap), 0.01, file),
        "pressure_a [bar]": noisy(1e-5 * pressure, 0.02, file),
    })  # fmt: skip


@pytest.mark.full(
    sibling="identify/benches/test_quasi_static_sweep.py::test_overlap_is_named_from_an_open_port"
)
def test_overlap_is_named_without_a_cylinder(tmp_path: Path) -> None:
    """Of a valve that is configured alone; `gap` agrees without the overlap, and not with it."""
    sound = metered(tmp_path / "sound.csv", 7, 0.0)
    fine, output = asked("gap", FLOW, [sound], [], tmp_path)
    assert "bench     a valve flow bench" in output
    assert fine["verdict"] == "agrees"
    files = [metered(tmp_path / f"{i}.csv", i, OVERLAP) for i in range(3)]
    gap, _ = asked("gap", FLOW, files[:2], files[2:], tmp_path)
    assert gap["verdict"] != "agrees"
    result, _ = asked("identify", FLOW, files[:2], files[2:], tmp_path)
    assert names(result) == ["overlap"]
    low, high = result["effects"][0]["interval"]
    assert low < OVERLAP < high
