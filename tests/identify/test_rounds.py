"""Data that a round of the search keeps."""

from typing import cast

import numpy as np

from hil_emulator.identify.estimation.excerpt import Excerpt
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.free_terms.balances import LOAD, PISTON
from hil_emulator.identify.selection.progress import Round


def test_of_each_balance_the_strongest_terms_keep_their_traces() -> None:
    """Every term keeps what it explains; the order stays."""
    empty, two = np.zeros(0), np.zeros(2)
    terms = [
        DiscrepancyTerm(balance, regressor, statistic, 50.0, two, two, np.ones((10, 2)))
        for balance, regressor, statistic in (
            (PISTON, "position", 100.0), (PISTON, "velocity", 300.0), (LOAD, "time", 60.0),
            (PISTON, "pressure sum", 200.0),
        )
    ]  # fmt: skip
    round_ = Round(Fit([], empty, np.zeros(10), np.zeros((10, 0)), 0.0), [], [], list(terms))
    round_.thin(2)
    assert [t.regressor for t in round_.terms if t.columns.size] == [
        "velocity",
        "time",
        "pressure sum",
    ]
    assert [t.statistic for t in round_.terms] == [t.statistic for t in terms]


def test_of_long_recordings_an_excerpt_of_the_traces_is_kept() -> None:
    """Later pictures of the gap use the rows in which candidates were scored."""
    rows, at = np.arange(2, 6), np.zeros(1)
    whole = Fit([], at, np.arange(10.0), np.arange(10.0)[:, None], 0.0)
    part = Fit([], at, 2.0 * whole.residual[rows], 2.0 * whole.jacobian[rows], 0.0)
    fitter = cast(Fitter, None)  # nothing is fitted
    excerpt = Excerpt(fitter, part, rows, np.full(4, 2.0))
    columns = np.arange(20.0, dtype=np.float32).reshape(10, 2)
    term = DiscrepancyTerm(PISTON, "position", 100.0, 50.0, at, at, columns)
    round_ = Round(whole, [], [], [term], excerpt=excerpt)
    round_.thin(1)
    assert round_.terms[0].columns.tolist() == (2.0 * columns[rows]).tolist()
    assert round_.columns_fit is part
    assert round_.base.sample_size == 10
    assert not round_.base.jacobian.size
