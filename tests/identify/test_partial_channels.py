"""Channels with values in a part of a log only: the others decide, with a note."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.api.actuator import ActuatorModel
from hil_emulator.api.identification import Identification
from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.identify import session
from hil_emulator.identify.session import Question
from tests.identify.rig_data import CACHE, knee, recorded

HEALTHY = recorded({}, "multisine", 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("channel", "rows"),
    [
        ("pressure_a", slice(3, None)),
        ("pressure_a", slice(0, 1900)),
        ("position", slice(60, None)),
        ("position", slice(500, 1500)),
    ],
)
def test_the_channels_that_go_on_decide(channel: str, rows: slice) -> None:
    """There is a verdict of a healthy machine that is not against it, and a page."""
    values = HEALTHY.readings[channel].copy()
    values[rows] = np.nan
    log = replace(HEALTHY, readings=HEALTHY.readings | {channel: values})
    result = session.identify(knee(), [log], question=Question(search=False), cache=CACHE)
    assert result.verdict in ("agrees", "cannot_examine")
    identification = Identification(ActuatorModel("knee", knee()), result)
    assert result.verdict in repr(identification)
    assert "<html" in identification.page()


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        (slice(40, None), "has values until 0.039 s of 0.399 s only"),
        (slice(0, 300), "begins 0.3 s after the others"),
        (slice(100, 300), "has no value from 0.099 to 0.3 s"),
    ],
)
def test_a_note_states_when_a_channel_has_no_values(
    tmp_path: Path, missing: slice, words: str
) -> None:
    """The time is that of the log."""
    cells = [f"{60 + np.cos(k / 7.0):.3f}" for k in range(400)]
    cells[missing] = [""] * len(cells[missing])
    rows = [f"{k * 1e-3:g},{k % 7},{cell},{40 + np.sin(k / 9.0)}" for k, cell in enumerate(cells)]
    file = tmp_path / "log.csv"
    heads = "time [s],valve_current [mA],pressure_a [bar],position [mm]"
    file.write_text("\n".join([heads, *rows]))
    (e,) = experiments([file], knee(), Meaning())
    assert any(note.startswith("pressure_a") and words in note for note in e.notes)
