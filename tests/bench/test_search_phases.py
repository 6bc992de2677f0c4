"""Run times of a search from the profiler."""

import cProfile
from pathlib import Path

import pytest

from hil_emulator.bench.search_phases import KeptProfile


def _outer() -> None:
    for _ in range(3):
        _inner()


def _inner() -> None:
    sum(range(1000))


@pytest.fixture
def profile(tmp_path: Path) -> KeptProfile:
    """Return what was kept of one outer call, which makes three inner ones."""
    watched = cProfile.Profile()
    watched.runcall(_outer)
    watched.dump_stats(tmp_path / "kept")
    return KeptProfile(tmp_path / "kept")


def test_calls_are_counted_and_what_they_call_is_their_time(profile: KeptProfile) -> None:
    """An outer call takes longer than the three inner ones."""
    outer, once = profile.of(_outer)
    inner, often = profile.of(_inner)
    assert (once, often) == (1, 3)
    assert outer > inner > 0.0


def test_what_was_not_called_took_no_time(profile: KeptProfile) -> None:
    """A search that ends early has phases that never began."""
    assert profile.of(test_what_was_not_called_took_no_time) == (0.0, 0)
