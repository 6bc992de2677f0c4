"""The first picture of an identification's page, and its remarks on unusual numbers."""

import numpy as np

from hil_emulator.identify.conclusion.findings import Refitted
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.reporting import report_tables
from hil_emulator.identify.reporting.pictures import SHOWN_SAMPLES, _stretch, widest_trace


def trace(frequency: np.ndarray, error: np.ndarray) -> dict[str, np.ndarray]:
    """Return a trace of a motion at 1 kHz with a frequency [Hz] and an error per sample."""
    measured = np.sin(2.0 * np.pi * np.cumsum(frequency) * 1e-3)
    missing = np.full(len(error), np.nan)
    return {"time": np.arange(len(error)) * 1e-3, "measured": measured, "noise": np.ones(1),
            "before": error, "after": error / 2, "free_before": missing,
            "free_after": missing}  # fmt: skip


def test_a_slow_stretch_goes_before_a_fast_one_with_more_error() -> None:
    """Of a sweep from 0.5 to 20 Hz its slow end is shown, as it disagrees enough to show it."""
    sweep = np.linspace(0.5, 20.0, 20_000)
    readable = trace(sweep, 1.0 + sweep / 20.0)
    shown = _stretch(readable, readable["before"])
    crossings = np.diff(np.signbit(readable["measured"][shown])).sum()
    assert crossings <= 10
    assert shown.stop - shown.start == SHOWN_SAMPLES


def test_a_log_that_can_be_read_goes_first() -> None:
    """Though another one disagrees more."""
    slow, fast = np.full(4000, 1.0), np.full(4000, 40.0)
    result = Result("disagrees", "", traces={
        "slow.csv/position": trace(slow, np.full(4000, 1.0)),
        "fast.csv/position": trace(fast, np.full(4000, 3.0)),
    })  # fmt: skip
    assert widest_trace(result) == "slow.csv/position"


def test_a_parameter_beyond_its_tolerance_gets_a_word() -> None:
    """10 % are a data sheet's; an interval that holds the configured value is no evidence."""
    result = Result("agrees", "", parameters={
        "moved": Refitted(1.0, 1.3, 1.2, 1.4, "m", "mm"),
        "vague": Refitted(1.0, 1.3, 0.9, 1.7, "m", "mm"),
        "near": Refitted(1.0, 1.05, 1.04, 1.06, "m", "mm"),
    })  # fmt: skip
    words = [row[-1] for row in report_tables.parameters(result).rows]
    assert words == ["check it", "", ""]


def test_an_error_below_its_floor_is_pointed_at() -> None:
    """Where nothing was named, the error before is the one that counts."""
    errors = {"before": 0.9, "after": 0.9, "floor": 1.0}
    gap = {"load_force": {"training": errors}, "position": {"training": errors | {"before": 1.1}}}
    result = Result("agrees", "", gap=gap)
    assert report_tables.below_floor(result) == ["load force"]
