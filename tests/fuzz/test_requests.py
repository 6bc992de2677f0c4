"""Requests to the remote control, without a process between: what the loop is asked to do."""

import pytest

from tests.fuzz.requests import attack


def test_two_thousand_requests() -> None:
    """Each is obeyed or refused where it is declared, while the rig runs on."""
    assert attack(2_000, seed=18) == 0


@pytest.mark.slow
def test_twenty_thousand_requests() -> None:
    """Others than those above."""
    assert attack(20_000, seed=19) == 0
