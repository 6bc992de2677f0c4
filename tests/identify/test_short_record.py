"""A record of a second shows too much by chance."""

import pytest

from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, knee, recorded


@pytest.mark.slow
def test_a_second_names_nothing() -> None:
    """Even a leakage that is there is only suspected; the reason says for how long to record."""
    found = identify(
        knee(), [recorded({"internal_leakage_conductance": 1e-12}, "steps", 1, 1.0)], cache=CACHE
    )
    assert found.verdict == "cannot_tell"
    assert not found.effects
    assert "1 s are too short" in found.reason
    assert "internal_leakage" in found.reason
    assert "record 2 s or more" in found.reason
