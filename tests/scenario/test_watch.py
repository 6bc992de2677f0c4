"""An expectation is open until no later tick can change it."""

import pytest

from hil_emulator.frame import Frame
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.frame_watch import AnsweringFrame, SeenFrame
from hil_emulator.scenario.watch import LimitedValue, ReachingValue, StayingValue


def states(watch: StayingValue | ReachingValue, values: dict[float, float]) -> list[str]:
    """Return the state after each time, as the value of that time is read."""
    noted = []
    for now, value in values.items():
        present[0] = value
        watch.tick(now)
        noted.append(watch.state)
    watch.end()
    return [*noted, watch.state]


present = [0.0]
BAND = LimitedValue("x", lambda: present[0], "{:g}".format, (0.0, 10.0))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({0.5: 99.0, 1.0: 5.0, 2.0: 5.0, 2.1: 99.0}, "open open open met met"),
        ({1.0: 5.0, 1.5: 11.0}, "open missed missed"),
        ({0.5: 5.0}, "open missed"),
    ],
)
def test_a_value_stays_in_its_band_in_a_time(values: dict[float, float], expected: str) -> None:
    """From 1 s to 2 s; values before and after do not count, and a sample has to be there."""
    assert states(StayingValue(BAND, 1.0, 2.0), values) == expected.split()


@pytest.mark.parametrize(
    ("values", "lasting", "expected"),
    [
        ({0.8: 5.0, 1.2: 5.0, 1.3: 5.0}, 0.5, "open open met met"),
        ({0.8: 5.0, 0.9: 99.0, 1.0: 5.0, 1.5: 5.0}, 0.5, "open open open met met"),
        ({0.8: 5.0, 1.2: 99.0}, 0.5, "open missed missed"),
        ({0.8: 99.0, 1.1: 5.0}, None, "open missed missed"),
        ({0.8: 5.0, 1.5: 5.0}, None, "open open met"),
        ({0.8: 5.0, 1.0: 5.0}, 0.5, "open open missed"),
    ],
)
def test_a_value_reaches_its_band_by_a_time(
    values: dict[float, float], lasting: float | None, expected: str
) -> None:
    """By 1 s, for 0.5 s or to the end; a band that was left may be entered again in time."""
    assert states(ReachingValue(BAND, 0.0, 1.0, lasting), values) == expected.split()


@pytest.mark.parametrize(
    ("required", "times", "expected"),
    [
        (True, [0.1], "met"),
        (True, [], "missed"),
        (True, [1.5], "missed"),
        (False, [0.1], "missed"),
        (False, [1.5], "met"),
    ],
)
def test_a_frame_is_seen_or_not(required: bool, times: list[float], expected: str) -> None:
    """Until 1 s: a frame that was seen stays seen."""
    e = Expect.model_validate({"frame": "0x085", "seen": required, "until": "1 s"})
    watch = SeenFrame(e, lambda frame: frame.can_id == 0x085)
    for time in times:
        watch.frames(time, [Frame(0x085), Frame(0x086)])
        watch.tick(time)
    watch.end()
    assert watch.state == expected


ASKS, ANSWERS = [Frame(1)], [Frame(2)]


@pytest.mark.parametrize(
    ("passing", "expected", "observed"),
    [
        ({1.0: ASKS, 1.02: ANSWERS, 1.1: ASKS, 1.11: ANSWERS}, "met", "2, after 20 ms at most"),
        ({1.0: ASKS, 1.01: ANSWERS, 1.1: ASKS, 1.13: []}, "missed", "no answer to the one at 1.1"),
        ({1.0: ASKS, 1.03: ANSWERS}, "missed", "1, after 30 ms at most"),
        ({1.0: ANSWERS}, "missed", "0"),
    ],
)
def test_a_frame_answers_each_other_one_in_time(
    passing: dict[float, list[Frame]], expected: str, observed: str
) -> None:
    """At most 20 ms later; without a question or an answer it is missed."""
    e = Expect.model_validate({"frame": "0x002", "after_each": "0x001", "by": "20 ms"})
    watch = AnsweringFrame(e, lambda f: f.can_id == 2, lambda f: f.can_id == 1)
    for time, frames in passing.items():
        watch.frames(time, frames)
        watch.tick(time)
    watch.end()
    assert watch.state == expected
    assert watch.observed.startswith(observed)
