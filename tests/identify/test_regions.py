"""Which balance disagrees and where, on machines that lack something known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.disagreement.regions import disagreements
from hil_emulator.identify.disagreement.residuals import draw, lacking, with_term
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.free_terms.balances import LEAKAGE
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.progress import Round
from tests.identify.rig_data import INSTRUMENTS, OFF, knee_model, recorded

CONDUCTANCE = 1e-13
"""Of the leakage that the machine has and the configuration lacks [m^3/(s*Pa)]."""


@cache
def observer() -> Observer:
    """Return an observer of a usual rig's channels."""
    return Observer(knee_model(), INSTRUMENTS)


@cache
def leaking() -> list[Experiment]:
    """Return experiments with a leaking cylinder."""
    effect = {"internal_leakage_conductance": CONDUCTANCE}
    return [recorded(effect, kind, 3 + i) for i, kind in enumerate(("multisine", "steps"))]


@cache
def configured() -> tuple[Fit, Fitter]:
    """Return the model without leakage, ordinary parameters refitted."""
    free = [c for c in parameters.ordinary(knee_model())
            if c.name in ("valve_gain", "oil_bulk_modulus", "coulomb_friction")]  # fmt: skip
    fitter = Fitter(observer(), leaking())
    fitter.freeze(free, np.zeros(3))
    fit = fitter.fit(free, np.zeros(3), 2)
    fitter.freeze(free, fit.at)
    return fitter.fit(free, fit.at, 1), fitter


@cache
def terms() -> list[DiscrepancyTerm]:
    """Return what every term explains of the leaking machine."""
    fit, fitter = configured()
    project = Projection(fit)
    return score_terms(fitter, fit.coordinates, fit.at, project)


def states() -> Regressors:
    """Return what the model's state was along the experiments."""
    fit, fitter = configured()
    par, chan = knee_model().memory(fit.coordinates, fit.at)
    tracks = [observer().innovations(f, par, chan, track=True)[1] for f in fitter.frozen]
    return regressors(np.vstack(tracks), knee_model().signal_names, leaking()[0].period)


def test_a_leak_is_a_disagreement_of_the_leakage_balance() -> None:
    """The balance with the largest share is the one that lacks a term; shares add up to one."""
    fit = configured()[0]
    noticeable = Round(fit, [], [], terms()).noticeable
    places = disagreements(fit, noticeable, states(), len(INSTRUMENTS))
    assert places[0].balance == LEAKAGE.name
    assert places[0].regressor == "pressure difference"
    assert sum(d.share for d in places) == pytest.approx(1.0)
    assert all(0.0 < r.time < 1.0 and r.share > r.time for d in places for r in d.regions)


def test_nothing_significant_is_no_disagreement() -> None:
    """Terms by chance, or below the noticeable share, are not reported."""
    fit, _ = configured()
    chance = [replace(t, statistic=t.limit) for t in terms()]
    little = [replace(t, statistic=t.null_mean + 1.0, limit=t.null_mean) for t in terms()]
    for some in (chance, little):
        noticeable = Round(fit, [], [], some).noticeable
        assert disagreements(fit, noticeable, {}, len(INSTRUMENTS)) == []


def test_a_term_that_another_one_holds_takes_no_share() -> None:
    """Of two equal terms the second has no share, whatever other terms there are."""
    fit = configured()[0]
    some = np.where(np.arange(len(fit.residual)) % 10 == 0, fit.residual, 0.0)
    other = replace(leak(), regressor="any", columns=some[:, None].astype(np.float32), limit=0.0)
    once, twice = (
        disagreements(fit, given, states(), len(INSTRUMENTS))
        for given in ([leak(), other], [leak(), replace(leak()), other])
    )
    assert [d.delta_chi2 for d in twice] == pytest.approx([d.delta_chi2 for d in once])


def leak() -> DiscrepancyTerm:
    """Return the leakage over the pressure difference."""
    return next(t for t in terms() if t.balance is LEAKAGE and t.regressor == "pressure difference")


def test_what_the_balance_lacks_is_the_leak_itself() -> None:
    """The smoothed term has the slope of the leak over the pressure difference, and its sign."""
    fit = configured()[0]
    moved = with_term(fit, leak())
    par, chan = knee_model().memory(moved.coordinates, moved.at)
    frozen = observer().freeze(leaking()[0], par, chan)
    term = lacking(observer(), frozen, par, chan, LEAKAGE)
    readings = leaking()[0].readings
    drop = readings["pressure_a"] - readings["pressure_b"]
    assert np.polyfit(drop[200:], term[200:], 1)[0] == pytest.approx(CONDUCTANCE, rel=0.3)


def test_a_map_shows_the_leak_before_and_nothing_after() -> None:
    """With the leak in the model the mean of the residual no longer follows its regressor."""
    fit, _ = configured()
    effects = parameters.candidates(knee_model(), INSTRUMENTS)
    effect = next(c for c in effects if c.name == "internal_leakage")
    at = np.append(with_term(fit, leak()).at, CONDUCTANCE / effect.scale)
    after = Fit([*fit.coordinates, effect], at, fit.residual, fit.jacobian, 0.0)
    drawn = draw(observer(), with_term(fit, leak()), after, leak(), leaking())
    assert (drawn.unit, drawn.regressor_unit) == ("l/min", "bar")
    assert np.nanstd(drawn.after.middle) < 0.3 * np.nanstd(drawn.before.middle)
    assert drawn.spectra[0][:5].sum() > drawn.spectra[1][:5].sum()


def test_what_no_law_explains_casts_doubt_on_what_it_moves() -> None:
    """The missing leak has moved the modulus by about its uncertainty."""
    fit, _ = configured()
    names = [c.name for c in fit.coordinates]
    i = names.index("oil_bulk_modulus")
    modulus = fit.coordinates[i]
    true = modulus.at(OFF["oil_bulk_modulus"] * modulus.neutral)
    error = abs(float(fit.at[i]) - true)
    uncertainty = float(np.linalg.norm([t.uncertainty[i] for t in terms()]))
    assert error > 5.0 * np.sqrt(fit.covariance()[i, i])
    assert 0.5 * error < uncertainty < 5.0 * error
