"""The table of cases, and the tests behind it."""

import re
from collections import Counter
from pathlib import Path

import hil_emulator.conformance
from hil_emulator.conformance.cases import CASES, CHAPTERS, OWN
from hil_emulator.conformance.report import Judgement, table

PACKAGE = Path(hil_emulator.conformance.__file__).parent
PER_CHAPTER = {1: 1, 2: 30, 3: 33, 4: 9, 5: 6, 6: 10, 7: 20, 8: 10, 9: 4, 10: 4}
"""Number of cases per chapter in the CAN in Automation conformance test tool."""


def test_the_cases_of_the_test_tool_are_there() -> None:
    """All 127 cases of the test tool exist by chapter; additional cases have other numbers."""
    cases = CASES.values()
    tool = [case for case in cases if case.number < OWN and case.chapter in PER_CHAPTER]
    assert Counter(case.chapter for case in tool) == PER_CHAPTER
    assert len(tool) == 127
    assert len(cases) == 226


def test_each_case_is_one_test() -> None:
    """Every case of the table has exactly one test function, and every function one case.

    Otherwise a case without a function would be missing in the report.
    """
    sources = [path.read_text() for path in PACKAGE.glob("test_*.py")]
    labels = [label for text in sources for label in re.findall(r'^@case\("(.*)"\)$', text, re.M)]
    tests = [name for text in sources for name in re.findall(r"^def (test_\w+)", text, re.M)]
    assert sorted(labels) == sorted(CASES)
    assert len(tests) == len(set(tests)) == len(CASES)


def test_the_report_counts_by_chapter() -> None:
    """Outcomes are counted in the line of their chapter and in the last line."""
    outcomes = {"2.7": "passed", "2.8": "failed", "10.1": "skipped"}
    judgements = {name: Judgement(outcome) for name, outcome in outcomes.items()}
    lines = list(table(judgements))
    assert len(lines) == len(CHAPTERS) + 2
    assert lines[2].split() == ["2", "SDO", "47", "1", "1", "0"]
    assert lines[-1].split() == ["all", "226", "1", "1", "1"]
