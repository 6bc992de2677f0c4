"""Tests that only `.ci/full` runs, and the smaller test that stands for each in every run.

    pytest --siblings

`@pytest.mark.full(sibling="file.py::test_name")` names a test that would fail for the same reason
and is not marked so itself; the path is relative to this folder, and left out for one in the same
file. A run of the whole suite refuses a mark without one.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

TESTS = Path(__file__).parent


def name_of(item: pytest.Item) -> str:
    """Return a test's path, relative to this folder, and its name without parameters."""
    path = item.path.relative_to(TESTS).as_posix()
    return f"{path}::{getattr(item, 'originalname', None) or item.name}"


def pairs(items: Sequence[pytest.Item]) -> Iterator[tuple[str, str]]:
    """Yield each test that is marked `full`, parameters included, and the name of its sibling."""
    for item in items:
        mark = item.get_closest_marker("full")
        if mark is not None:
            sibling = str(mark.kwargs.get("sibling", ""))
            own_file = name_of(item).partition("::")[0]
            yield item.nodeid, sibling if "::" in sibling else f"{own_file}::{sibling}"


def without_sibling(items: Sequence[pytest.Item]) -> list[str]:
    """Return the tests marked `full` whose sibling does not run by itself in every run."""
    always = {name_of(item) for item in items if item.get_closest_marker("full") is None}
    return [f"{test}: {sibling}" for test, sibling in pairs(items) if sibling not in always]
