"""Where a refit of a candidate begins, when its slope leads nowhere."""

import numpy as np
import pytest

from hil_emulator.identify.naming.confirm import Confirmation
from hil_emulator.identify.naming.fit import TOLERATED
from hil_emulator.identify.naming.progress import Search
from hil_emulator.identify.naming.scan import scan
from hil_emulator.identify.naming.search import Searcher
from hil_emulator.identify.prediction import parameters
from hil_emulator.identify.prediction.observer import Observer
from tests.identify.rig_data import INSTRUMENTS, knee_twin, recorded

DELAY = 7e-4
"""Of the set point that the machine has and the configuration lacks [s]."""


def test_a_delay_is_found_behind_the_slow_valve_that_was_fitted_in_its_place() -> None:
    """The search tries the delay where the valve is as fast as its data sheet says."""
    kinds = ("multisine", "steps")
    data = [recorded({"transport_delay_time": DELAY}, kind, 7 + i) for i, kind in enumerate(kinds)]
    twin = knee_twin()
    free = [c for c in parameters.ordinary(twin)
            if c.name in ("valve_gain", "valve_natural_frequency", "oil_bulk_modulus")]  # fmt: skip
    search = Search(free, at=np.zeros(len(free)))
    searcher = Searcher(Observer(twin, INSTRUMENTS), data, [], [], free)
    fit, fitter = searcher.settle(search), searcher.fitter
    valve = [c.name for c in free].index("valve_natural_frequency")
    assert fit.at[valve] < -TOLERATED
    delay = next(c for c in parameters.candidates(twin, INSTRUMENTS) if c.name == "transport_delay")
    found = Confirmation(fitter, fit).best(scan(fitter, fit, [delay]), 1)[0]
    assert found.start is not None
    assert found.estimate * delay.scale == pytest.approx(DELAY, rel=0.05)
    assert abs(found.start[valve]) < 1.0
