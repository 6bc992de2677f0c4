"""Logs to which accidents have happened are read, cleaned and judged, or refused in one message."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.errors import UserError
from hil_emulator.identify.data_checks.copies import counted
from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.data_checks.sound import DRIVEN, travel, without_contradictions
from hil_emulator.identify.measured.data import load_experiments
from tests.identify.mutations import mutated
from tests.identify.rig_data import knee_model


def judged(file: Path) -> str:
    """Read a log and check it; return how far it came."""
    try:
        found = load_experiments([file])
    except UserError as error:
        return "refused" if file.name in str(error) else str(error)
    for e in found:
        for values in (e.current, *e.readings.values()):
            assert len(values) in (0, e.samples)
            assert not np.isinf(values).any(), e.name
    learn, _, notes = without_contradictions(*counted(found, []), knee_model().plant_values)
    assert all(note.startswith("left out: ") for note in notes)
    moving = [e for e in learn if travel(e) >= DRIVEN]
    return "contradicts" if contradictions(moving, knee_model().plant_values) else "accepted"


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_a_hundred_accidents_end_in_no_traceback(tmp_path: Path) -> None:
    """Whatever happened: experiments of finite readings, or one message that names the file."""
    fates = [judged(mutated(tmp_path / f"log{seed}.csv", seed)) for seed in range(100)]
    assert {"refused", "contradicts", "accepted"} == set(fates)
