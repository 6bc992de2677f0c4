"""Near rivals of an effect whose law does not fit."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.rivals import near_rivals, rival_start
from hil_emulator.identify.selection.scan import Score
from hil_emulator.model.effects import lines
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

COORDINATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}
FLOW = 20e-3 / 60.0
"""Of the machine's pump, whose stroke is controlled [m^3/s]."""


def test_parts_that_a_user_knows_are_not_candidates() -> None:
    """A holding valve between valve and cylinder is known; the limit of a pump may not be."""
    assert not {effect.name for effect in lines.EFFECTS} & set(COORDINATES)
    assert "fixed_pump" in COORDINATES


@pytest.fixture(scope="module")
def pumped() -> tuple[Fitter, Search, Round]:
    """Return a search that named a pump with a relief valve instead of a compensator."""
    changes = {"variable_pump_flow": FLOW}
    data = [recorded(changes, kind, 5 + i) for i, kind in enumerate(("multisine", "steps"))]
    model = knee_model()
    free = [c for c in parameters.ordinary(model)
            if c.name in ("valve_gain", "oil_bulk_modulus", "coulomb_friction")]  # fmt: skip
    fitter = Fitter(Observer(model, INSTRUMENTS), data)
    pump = COORDINATES["fixed_pump"]
    start = np.append(np.zeros(len(free)), 1.0)
    whole = [*free, *model.shapes(pump), pump]
    at = np.insert(start, len(free), np.zeros(len(whole) - len(start)))
    for _ in range(3):
        fitter.freeze(whole, at)
        final = fitter.fit(whole, at, 6)
        at = final.at
    search = Search(free, model.shapes(pump), [pump], final.at, final=final)
    round_ = Round(final, [scored("variable_pump", 0.0)], [trial("fixed_pump", 1000.0, final)], [])
    search.rounds.append(replace(round_, accepted=True))
    return fitter, search, search.rounds[0]


def scored(name: str, statistic: float, estimate: float = 0.0) -> Score:
    """Return the score of a candidate whose linearisation fails."""
    empty = np.zeros(0)
    return Score(COORDINATES[name], statistic, estimate, statistic, empty, empty, empty)


def trial(name: str, delta_chi2: float, fit: Fit) -> Trial:
    """Return a refitted candidate with such a gain."""
    evidence = Evidence(delta_chi2, delta_chi2, delta_chi2, 20.0)
    return Trial(scored(name, delta_chi2), fit, evidence, 1.0)


@pytest.mark.slow
def test_a_pump_with_a_state_is_found_in_place_of_one_without(
    pumped: tuple[Fitter, Search, Round],
) -> None:
    """With filter gains that correct its stroke, the rival converges to the true pump."""
    fitter, search, round_ = pumped
    near = near_rivals(fitter, search, round_)
    assert list(near) == ["variable_pump"]
    coordinates, at = near["variable_pump"]
    assert coordinates[-1].name == "variable_pump"
    droop = coordinates[0].value(at[0]) / coordinates[-1].value(at[-1])
    assert droop == pytest.approx(10e5 / FLOW, rel=0.1)
    again = replace(round_, near_rivals=near)
    assert rival_start(again, "variable_pump") is near["variable_pump"]


@pytest.mark.slow
def test_a_rival_without_a_refit_starts_at_its_linear_estimate(
    pumped: tuple[Fitter, Search, Round],
) -> None:
    """A candidate of the same place that was not refitted in its round is tried."""
    fitter, search, round_ = pumped
    sloped = replace(round_, scores=[scored("variable_pump", 600.0, 1.0)])
    assert list(near_rivals(fitter, search, sloped)) == ["variable_pump"]


def test_the_gains_are_those_of_the_finished_model_again(
    pumped: tuple[Fitter, Search, Round],
) -> None:
    """Afterwards the fitter has the filter gains of the final model."""
    fitter, search, round_ = pumped
    assert search.final is not None
    fitter.freeze(search.final.coordinates, search.final.at)
    before = fitter.frozen[0].gains.kalman.copy()
    near_rivals(fitter, search, round_)
    np.testing.assert_array_equal(fitter.frozen[0].gains.kalman, before)


@pytest.mark.parametrize(
    ("rival", "delta_chi2"), [("accumulator", 400.0), ("load_spring", 990.0)],
    ids=["explained little", "acts elsewhere"],
)  # fmt: skip
def test_other_rivals_are_not_tried(
    pumped: tuple[Fitter, Search, Round], rival: str, delta_chi2: float
) -> None:
    """Candidates with clearly smaller gains, or at another place, are not refitted."""
    fitter, search, round_ = pumped
    one = replace(round_, scores=[], trials=[*round_.trials, trial(rival, delta_chi2, round_.base)])
    assert near_rivals(fitter, search, one) == {}
