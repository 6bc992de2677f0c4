"""What the tools of the study take for cases on their command lines."""

from argparse import ArgumentTypeError

import pytest

from tests.studies.generator.cases import short_cases


def test_several_cases_of_a_bench_are_called_at_once() -> None:
    """From a number on, so many of them; each as it is called by its own name."""
    several = short_cases("pairs-572:3@axis")
    assert [c.name for c in several] == [f"pairs-{i}@axis" for i in (572, 573, 574)]
    assert [several[1]] == short_cases("pairs-573@axis")


@pytest.mark.parametrize(
    ("name", "way_out"),
    [("foo", "groups are medium"), ("medium-3@axes", "benches axis"),
     ("medium-three", "wrong number"), ("medium-3:x", "600:20")],
)  # fmt: skip
def test_an_unknown_case_gets_the_way_out(name: str, way_out: str) -> None:
    """A typing mistake is no other case, and no traceback."""
    with pytest.raises(ArgumentTypeError, match=way_out):
        short_cases(name)
