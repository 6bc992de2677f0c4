"""A reader reads any file or rejects it with one message."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.files import CORPUS, Study
from tests.fuzz.readers import READERS, Reader, attempt

KEPT = [pytest.param(r, f, id=f.name) for r in READERS for f in sorted((CORPUS / r.name).glob("*"))]


COMPILED = frozenset({"nbi", "nbc"})
"""Kinds that need the model compiled first."""


def study(cases: range, seed: int, without: frozenset[str] = frozenset()) -> None:
    """Put mutated files to all readers."""
    made = Study(seed, without)
    for case in cases:
        made.one(case)
    made.close()
    assert not made.failures, made.report()


def test_sound_files_are_read() -> None:
    """What is damaged below has been sound: each reader takes what its writer has made."""
    made = Study(1, without=COMPILED)
    made.sound()
    made.close()
    assert {result for _, result in made.counts} == {"read"}, made.report()


def test_some_hundred_mutants() -> None:
    """Of every format, from the recording to the database of messages."""
    study(range(150), seed=18, without=COMPILED)


@pytest.mark.full(sibling="test_some_hundred_mutants")
def test_two_thousand_mutants() -> None:
    """Others than those above."""
    study(range(2_000), seed=19)


@pytest.mark.parametrize(("reader", "file"), KEPT)
def test_a_file_that_once_was_a_traceback(reader: Reader, file: Path) -> None:
    """Each is refused now."""
    assert not attempt(reader, file)


@pytest.mark.slow
def test_a_campaign_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    """Its counts are in its file; a second run adds the cases that are left."""
    state = tmp_path / "campaign.json"
    for cases in (10, 25):
        command = (sys.executable, "-m", "tests.fuzz.campaign", "--without", "nbi,nbc")
        subprocess.run([*command, "--cases", str(cases), "--state", state], check=True)
        assert json.loads(state.read_text())["done"] == cases
