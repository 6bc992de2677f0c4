"""The example tests: fast, repeatable, and able to find a mistake."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
MOTION = {
    "test_a_step_settles_fast_and_without_much_overshoot",
    "test_it_rides_through_lost_samples",
    "test_it_rides_through_a_supply_drop",
    "test_it_takes_a_restarted_node_back",
}
STUCK = "test_it_notices_a_stuck_position"
BROKEN_SENSOR = "test_it_closes_the_valve_when_the_position_sensor_breaks"
EXPECTED = {
    "deaf": {BROKEN_SENSOR, "test_it_stops_at_an_emergency"},
    "trusting": {STUCK, "test_it_closes_the_valve_when_the_heartbeat_stops"},
    "careless": {"test_it_refuses_another_mapping"},
}


def examples(controller: str, log: Path, *options: str) -> tuple[set[str], str]:
    """Run the examples with a controller; return the tests that failed, and the output."""
    environment = os.environ | {"EXAMPLE_CONTROLLER": controller, "EXAMPLE_DIGESTS": str(log)}
    result = subprocess.run(
        [sys.executable, "-m", "pytest", str(EXAMPLES), "-p", "no:cacheprovider", *options],
        capture_output=True,
        text=True,
        env=environment,
        cwd=log.parent,
        timeout=120,
        check=False,
    )
    assert "10 passed" in result.stdout or " failed" in result.stdout, result.stdout
    return set(re.findall(r"^FAILED \S+::(\w+)", result.stdout, re.M)), result.stdout


@pytest.mark.full(sibling="test_a_wrong_sign_fails_all_that_moves")
@pytest.mark.parametrize("controller", EXPECTED)
def test_each_mistake_fails_the_tests_that_are_about_it(controller: str, tmp_path: Path) -> None:
    """A deaf, a trusting and a careless controller fail theirs, and no others."""
    failed, _ = examples(controller, tmp_path / "digests")
    assert failed == EXPECTED[controller]


@pytest.mark.slow
def test_a_wrong_sign_fails_all_that_moves(tmp_path: Path) -> None:
    """The rod runs away: every test of motion fails."""
    failed, _ = examples("backwards", tmp_path / "digests")
    assert failed >= MOTION


@pytest.mark.slow
def test_they_are_identical_on_repetition(tmp_path: Path) -> None:
    """Every frame of every test is the same again in two processes."""
    digests = []
    for name, options in (("alone", ()), ("xdist", ("-n", "2"))):
        failed, _ = examples("sound", tmp_path / name, *options)
        assert not failed
        digests.append(sorted((tmp_path / name).read_text().splitlines()))
    assert len(digests[0]) == 10
    assert digests[0] == digests[1]
