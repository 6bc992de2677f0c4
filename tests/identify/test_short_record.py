"""A record of a second shows too much by chance."""

import pytest

from hil_emulator.identify.conclusion.record_limits import doubt_haste
from hil_emulator.identify.conclusion.result import Result, Verdict
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, INSTRUMENTS, knee, knee_model, recorded


@pytest.mark.slow
def test_a_second_names_nothing() -> None:
    """A true leakage is only suspected; the reason states the length that is needed."""
    result = identify(
        knee(), [recorded({"internal_leakage_conductance": 1e-12}, "steps", 1, 1.0)], cache=CACHE
    )
    assert result.verdict == "cannot_tell"
    assert not result.effects
    assert "1 s are too short" in result.reason
    assert "internal_leakage" in result.reason
    assert "record 2 s or more" in result.reason


@pytest.mark.parametrize(
    ("verdict", "limited"),
    [("disagrees", "cannot_tell"), ("unknown_effect", "cannot_tell"), ("agrees", "agrees")],
)  # fmt: skip
def test_gap_and_identify_doubt_a_short_record_alike(verdict: Verdict, limited: Verdict) -> None:
    """On one second of data a disagreement of `gap` is as doubtful as a name."""
    result = Result(verdict, "the model leaves 2 bar")
    second = recorded({}, "steps", 1, 1.0)
    doubt_haste(result, Observer(knee_model(), INSTRUMENTS), [second])
    assert result.verdict == limited
