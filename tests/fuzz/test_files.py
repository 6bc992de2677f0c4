"""Whatever a file holds, its reader reads it or says in one message why not."""

from pathlib import Path

import pytest

from tests.fuzz.files import CORPUS, Study
from tests.fuzz.readers import READERS, Reader, attempt

KEPT = [pytest.param(r, f, id=f.name) for r in READERS for f in sorted((CORPUS / r.name).glob("*"))]


def study(count: int, seed: int) -> None:
    """Put mutated files to all readers."""
    made = Study(seed)
    made.run(count)
    made.close()
    assert not made.failures, made.report()


def test_some_hundred_mutants() -> None:
    """Of every format, from the recording to the database of messages."""
    study(400, seed=18)


@pytest.mark.full(sibling="test_some_hundred_mutants")
def test_two_thousand_mutants() -> None:
    """Others than those above."""
    study(2_000, seed=19)


@pytest.mark.parametrize(("reader", "file"), KEPT)
def test_a_file_that_once_was_a_traceback(reader: Reader, file: Path) -> None:
    """Each is refused now."""
    assert not attempt(reader, file)
