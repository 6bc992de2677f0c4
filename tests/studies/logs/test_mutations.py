"""Logs to which accidents have happened are read, cleaned and judged, or refused in one message."""

from pathlib import Path

import pytest

from tests.studies.logs.accidents import judged
from tests.studies.logs.mutations import mutated


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "seeds",
    [
        range(6),
        pytest.param(
            range(100), marks=pytest.mark.full(sibling="test_accidents_end_in_no_traceback")
        ),
    ],
)
def test_accidents_end_in_no_traceback(tmp_path: Path, seeds: range) -> None:
    """Whatever happened: experiments of finite readings, or one message that names the file."""
    fates = [judged(mutated(tmp_path / f"log{seed}.csv", seed)) for seed in seeds]
    assert {"contradicts", "accepted"} <= set(fates) <= {"refused", "contradicts", "accepted"}
