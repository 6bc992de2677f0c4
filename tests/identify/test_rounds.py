"""What a round of the search remembers."""

import numpy as np

from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.prediction.balances import LOAD, PISTON
from hil_emulator.identify.selection.progress import Round


def test_of_each_balance_the_strongest_terms_keep_their_traces() -> None:
    """Every term keeps what it explains; the order stays."""
    none, two = np.zeros(0), np.zeros(2)
    terms = [
        DiscrepancyTerm(balance, regressor, statistic, 50.0, two, two, np.ones((10, 2)))
        for balance, regressor, statistic in (
            (PISTON, "position", 100.0), (PISTON, "velocity", 300.0), (LOAD, "time", 60.0),
            (PISTON, "pressure sum", 200.0),
        )
    ]  # fmt: skip
    found = Round(Fit([], none, np.zeros(10), np.zeros((10, 0)), 0.0), [], [], list(terms))
    found.thin(2)
    assert [t.regressor for t in found.terms if t.columns.size] == [
        "velocity",
        "time",
        "pressure sum",
    ]
    assert [t.statistic for t in found.terms] == [t.statistic for t in terms]
