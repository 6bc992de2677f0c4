"""The current of a row acted before its readings or acts after them: stated, or seen from them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.identify import session
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import Question
from tests.identify.rig_data import CACHE, knee, recorded

HEALTHY = recorded({}, "multisine", 3)


def led_to_its_row(e: Experiment) -> Experiment:
    """Return a log whose rows hold the current that led to their readings, without a statement."""
    return replace(e, current=np.append(e.current[:1], e.current[:-1]), order_assumed=True)


@pytest.mark.slow
def test_a_row_of_shift_is_seen_and_taken_back() -> None:
    """A healthy machine agrees, whichever order its log has; a note names the option."""
    log = led_to_its_row(HEALTHY)
    result = session.identify(knee(), [log], question=Question(search=False), cache=CACHE)
    assert result.verdict == "agrees"
    assert any("--current-acts" in note for note in result.notes)


def test_a_log_in_the_assumed_order_stays() -> None:
    """No shift and no note if a row's current acts after its readings."""
    log = replace(HEALTHY, order_assumed=True)
    result = session.identify(knee(), [log], question=Question(search=False), cache=CACHE)
    assert result.verdict == "agrees"
    assert not any("--current-acts" in note for note in result.notes)


@pytest.mark.parametrize(("stated", "first"), [(True, 2e-3), (False, 1e-3), (None, 1e-3)])
def test_the_order_can_be_stated(tmp_path: Path, stated: bool | None, first: float) -> None:
    """A stated order is used without an estimate from the readings."""
    rows = [f"{k * 1e-3},{(k + 1) * 1e-3},{40 + np.sin(k / 9.0)}" for k in range(100)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["time [s],valve_current [A],position [mm]", *rows]))
    (e,) = experiments([file], knee(), Meaning(set_point_first=stated))
    assert e.current[0] == pytest.approx(first)
    assert e.order_assumed == (stated is None)
