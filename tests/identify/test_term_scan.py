"""Free terms: scores of laws of any form, by balance."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import (
    DiscrepancyTerm,
    null_distribution,
    score_terms,
)
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.prediction.free_terms.balances import NULL_FLOW, RETURN, TERMS
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.law_form import nearest
from hil_emulator.identify.selection.scan import scan
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

RESISTANCE = 3e13
"""Of the return line that the machine has and the configuration lacks [Pa*s^2/m^6]."""


Seen = tuple[Fitter, list[DiscrepancyTerm], Fit]
"""The data of a machine, its free terms, and the fit to which they are added."""


@pytest.fixture(scope="module")
def returning() -> Seen:
    """Return the terms of a machine with a narrow return line."""
    changes = {"back_pressure_resistance": RESISTANCE}
    data = [recorded(changes, kind, 3 + i) for i, kind in enumerate(("multisine", "steps"))]
    model = knee_model()
    free = parameters.ordinary(model)
    fitter = Fitter(Observer(model, INSTRUMENTS), data)
    fit = converge(fitter, free, np.zeros(len(free)))
    return fitter, score_terms(fitter, free, fit.at, Projection(fit)), fit


@pytest.mark.slow
def test_a_narrow_return_line_is_a_pressure_over_the_flow_through_it(returning: Seen) -> None:
    """No other balance explains as much, and the curve rises with the square."""
    best = max(returning[1], key=lambda t: t.excess)
    assert best.title == "return pressure over return flow"
    flow = best.knots[-1]
    assert best.curve[-1] == pytest.approx(RESISTANCE * flow**2, rel=0.3)
    assert abs(best.curve[1]) < 0.2 * best.curve[-1]


@pytest.mark.slow
def test_the_return_line_is_nearest_to_the_term(returning: Seen) -> None:
    """Sensor errors explain a part of it, too."""
    fitter, terms, _ = returning
    term = next(t for t in terms if t.balance is RETURN)
    free = [c for c in parameters.ordinary(knee_model()) if c.name == "valve_gain"]
    fit = fitter.fit(free, np.zeros(1), 3)
    candidates = parameters.candidates(knee_model(), INSTRUMENTS)
    assert nearest(term, scan(fitter, fit, candidates)) == "back_pressure"


def test_a_term_of_each_balance_is_scored(returning: Seen) -> None:
    """The mean by chance is below the critical value, and the true term exceeds both."""
    terms = returning[1]
    assert {t.title for t in terms} == {
        f"{balance.name} over {regressor}"
        for balance, regressor in TERMS
        if balance is not NULL_FLOW  # a bench with flow meters shows it
    }
    assert all(0.0 < t.null_mean < t.limit for t in terms)
    best = max(terms, key=lambda t: t.excess)
    assert 0.0 < best.excess < best.surplus < best.statistic


def test_few_terms_of_each_balance_keep_their_columns(returning: Seen) -> None:
    """The strongest term keeps its columns; all numbers stay the same."""
    fitter, terms, fit = returning
    few = score_terms(fitter, fit.coordinates, fit.at, Projection(fit), kept=1)
    assert [t.statistic for t in few] == [t.statistic for t in terms]
    kept = [t for t in few if t.columns.size]
    strongest = {t.balance.name: t for t in sorted(terms, key=lambda t: t.statistic)}
    assert {t.title for t in kept} == {t.title for t in strongest.values() if t.significant}
    assert len(kept) < sum(t.columns.size > 0 for t in terms)


def test_a_term_without_influence_explains_nothing() -> None:
    """Without columns the statistic is zero, as by chance."""
    residual = np.random.default_rng(1).standard_normal(100)
    assert null_distribution(np.zeros((100, 0)), residual, 0, 10) == (0.0, 10.0)


def test_the_influence_of_a_term_decays_to_zero(returning: Seen) -> None:
    """Long after a term, its influence is exactly zero, not a subnormal number.

    Subnormal numbers, and products that become subnormal, take ten times as long.
    """
    fitter, _, _ = returning
    frozen = fitter.batch.frozen[0]
    term = np.zeros((len(frozen.experiment.readings["position"]), 1))
    term[200:300] = 1e4
    column = fitter.predictor.through(frozen, RETURN, term)[0]
    assert np.max(np.abs(column)) > 1e-3
    assert column[-1] == 0.0
    least = np.abs(column[column != 0.0]).min()
    assert np.float32(least) ** 2 >= np.finfo(np.float32).tiny
