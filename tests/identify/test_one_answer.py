"""`gap` and `identify` give one answer about one log."""

import pytest

from hil_emulator.identify import session
from hil_emulator.identify.session import Question
from tests.identify.rig_data import CACHE, knee, recorded, without


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "missing"), [(5, ()), (8, ("load_force",))])
def test_both_commands_judge_a_healthy_machine_alike(seed: int, missing: tuple[str, ...]) -> None:
    """With fewer channels, too: no balance disagrees where nothing is missing."""
    log = without(recorded({}, "steps", seed, duration=1.5), *missing)
    measured = session.identify(knee(), [log], question=Question(search=False), cache=CACHE)
    searched = session.identify(knee(), [log], cache=CACHE)
    verdicts = {"agrees": "nothing_missing", "disagrees": "unknown_effect"}
    assert searched.verdict == verdicts[measured.verdict]
    assert bool(measured.where) == (measured.verdict == "disagrees")
