"""What a name needs, against what chance gives the best of all candidates."""

import numpy as np
import pytest

from hil_emulator.identify.selection.levels import FALSE_ALARM
from tests.studies.generator.benches import BENCHES
from tests.studies.generator.cases import case
from tests.studies.rules.null_distribution import examined


@pytest.mark.full(sibling="identify/test_levels.py::test_a_number_is_right_within_a_factor_of_ten")
@pytest.mark.parametrize("bench", ["", "axis"])
def test_a_thousandth_of_healthy_machines_has_an_effect_by_chance_at_most(bench: str) -> None:
    """Many candidates are alike: the best of all reaches less than their number lets one expect.

    It is not far less, or weak effects would be silenced for nothing: half of what is needed comes
    up more often than once in a thousand.
    """
    drawn = examined(case("none", 60, 2.0, BENCHES[bench]))
    assert drawn.candidates > 50
    assert drawn.alarms <= FALSE_ALARM
    assert np.mean(drawn.best > 0.5 * drawn.needed) > FALSE_ALARM
