"""The table of cases, and the tests behind it."""

import re
from collections import Counter
from pathlib import Path

import hil_emulator.conformance
from hil_emulator.conformance.cases import CASES, CHAPTERS
from hil_emulator.conformance.plugin import table

PACKAGE = Path(hil_emulator.conformance.__file__).parent
PER_CHAPTER = {1: 1, 2: 30, 3: 33, 4: 9, 5: 6, 6: 10, 7: 20, 8: 10, 9: 4, 10: 4}
"""Of the CAN in Automation conformance test tool."""


def test_there_are_127_cases() -> None:
    """Each chapter has as many cases as the test tool."""
    assert Counter(case.chapter for case in CASES.values()) == PER_CHAPTER
    assert len(CASES) == 127


def test_each_case_is_one_test() -> None:
    """Every case of the table is behind exactly one test function, and the other way round.

    This guards the report: a case that no test asks would be missing from it without a word.
    """
    sources = [path.read_text() for path in PACKAGE.glob("test_*.py")]
    labels = [found for text in sources for found in re.findall(r'^@case\("(.*)"\)$', text, re.M)]
    tests = [name for text in sources for name in re.findall(r"^def (test_\w+)", text, re.M)]
    assert sorted(labels) == sorted(CASES)
    assert len(tests) == len(set(tests)) == len(CASES)


def test_the_report_counts_by_chapter() -> None:
    """Outcomes are counted in the line of their chapter and in the last line."""
    lines = list(table({"2.7": "passed", "2.8": "failed", "10.1": "skipped"}))
    assert len(lines) == len(CHAPTERS) + 2
    assert lines[2].split() == ["2", "SDO", "30", "1", "1", "0"]
    assert lines[-1].split() == ["all", "127", "1", "1", "1"]
