"""The worked scenarios: they pass, fast, and in the same way wherever they run."""

from pathlib import Path

import pytest

from hil_emulator.scenario.spread import run_all

SCENARIOS = sorted((Path(__file__).parents[2] / "configs" / "scenarios").glob("*.toml"))
FILES = [file for file in SCENARIOS if "inclined_axis" not in file.read_text()]
"""Those of the reference controller; `test_inclined_axis` plays the others with another one."""


def test_all_pass() -> None:
    """One after the other in this process; every expectation is met."""
    outcomes = run_all(FILES, role="reference")
    assert len(outcomes) == 12
    missed = [(o.title, o.error, [c for c in o.checks if not c.passed]) for o in outcomes]
    assert [m for m in missed if m[1] or m[2]] == []
    assert all(o.checks for o in outcomes)


@pytest.mark.full(sibling="test_all_pass")
def test_they_are_the_same_with_two_workers_and_on_a_cluster() -> None:
    """Every frame and signal of all: in this process, in two, on a Dask cluster."""
    from distributed import LocalCluster

    alone = [o.digest for o in run_all(FILES, role="reference")]
    assert all(alone)
    assert [o.digest for o in run_all(FILES, workers=2, role="reference")] == alone
    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        spread = run_all(FILES, cluster=cluster.scheduler_address, role="reference")
    assert [o.digest for o in spread] == alone
