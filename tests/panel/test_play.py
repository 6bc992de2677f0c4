"""A scenario that is still played: what is settled of its expectations, and what is open."""

import pytest

from hil_emulator.panel.play import state
from hil_emulator.scenario.outcome import Check
from hil_emulator.scenario.schema import Expect

BAND = {"signal": "position", "within": ["0 mm", "10 mm"]}


@pytest.mark.parametrize(
    ("expected", "passed", "now", "said"),
    [
        (BAND | {"from": "1 s", "until": "2 s"}, True, 1.5, "open"),
        (BAND | {"from": "1 s", "until": "2 s"}, True, 2.0, "met"),
        (BAND | {"from": "1 s", "until": "2 s"}, False, 1.5, "missed"),
        (BAND | {"from": "1 s", "until": "2 s"}, False, 0.5, "open"),
        (BAND | {"by": "1 s", "for": "0.5 s"}, True, 1.2, "met"),
        (BAND | {"by": "1 s", "for": "0.5 s"}, False, 1.2, "open"),
        (BAND | {"by": "1 s", "for": "0.5 s"}, False, 1.6, "missed"),
        (BAND | {"by": "1 s"}, True, 1.5, "open"),
        ({"frame": "0x085"}, True, 0.1, "met"),
        ({"frame": "0x085"}, False, 0.1, "open"),
        ({"frame": "0x085", "seen": False}, False, 0.1, "missed"),
        ({"frame": "0x085", "seen": False, "until": "1 s"}, True, 1.0, "met"),
    ],
)
def test_a_check_is_settled_when_no_later_tick_can_change_it(
    expected: dict[str, object], passed: bool, now: float, said: str
) -> None:
    """A band that was left stays left, a frame that was seen stays seen."""
    check = Check("", passed, "")
    assert state(Expect.model_validate(expected), check, now, over=False) == said
    assert state(Expect.model_validate(expected), check, now, over=True) != "open"
