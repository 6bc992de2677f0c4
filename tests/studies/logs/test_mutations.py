"""Logs to which accidents have happened are read, cleaned and judged, or refused in one message."""

from pathlib import Path

import pytest

from tests.studies.logs.accidents import judged
from tests.studies.logs.mutations import mutated


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_a_hundred_accidents_end_in_no_traceback(tmp_path: Path) -> None:
    """Whatever happened: experiments of finite readings, or one message that names the file."""
    fates = [judged(mutated(tmp_path / f"log{seed}.csv", seed)) for seed in range(100)]
    assert {"refused", "contradicts", "accepted"} == set(fates)
