"""Effects that were named for what an unknown one does, on problems with a known answer."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.prediction.balances import LOAD, PISTON, Balance
from hil_emulator.identify.prediction.parameters import candidates
from hil_emulator.identify.selection.free_terms import DiscrepancyTerm
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.re_examination import redundant
from tests.identify.rig_data import INSTRUMENTS, knee_model

COORDINATES = {c.name: c for c in candidates(knee_model(), INSTRUMENTS)}
N = 2000


def waves() -> tuple[np.ndarray, np.ndarray]:
    """Return two sensitivities at right angles, each of length one."""
    time = 2.0 * np.pi * np.arange(N) / N
    return np.sin(8.0 * time) * np.sqrt(2.0 / N), np.cos(8.0 * time) * np.sqrt(2.0 / N)


def after(
    mine: float, unknown: float, name: str = "supply_pressure.gain_error",
    balance: Balance = PISTON,
) -> tuple[Search, Round]:  # fmt: skip
    """Return a search that named an effect whose sensitivity is half that of an unknown term's.

    Args:
        mine: how much of the effect there is in the data.
        unknown: how much of the term.
        name: of the effect.
        balance: where the term sits.

    """
    straight, aside = waves()
    shape, sensitivity = straight, 0.5 * straight + np.sqrt(0.75) * aside
    data = mine * sensitivity + unknown * shape
    size = float(sensitivity @ data)
    residual = data - size * sensitivity
    effect = COORDINATES[name]
    chi2 = float(residual @ residual)
    fit = Fit([effect], np.array([size]), residual, -sensitivity[:, None], chi2)
    left = float((unknown * np.sqrt(0.75)) ** 2)
    columns = -shape[:, None]
    term = DiscrepancyTerm(balance, "velocity", left, 0.1 * left, np.zeros(1), np.zeros(1), columns)
    found = Round(fit, [], [], [term], unknown=True)
    return Search([], effects=[effect], at=fit.at, rounds=[found]), found


def test_an_effect_that_only_stands_for_an_unknown_one_is_told() -> None:
    """Of a term that is there alone, half was named as what lies along the effect's sensitivity."""
    found = redundant(*after(0.0, 100.0))
    assert found is not None
    assert found[0].name == "supply_pressure.gain_error"
    assert found[1] == "force on the piston over velocity"


@pytest.mark.parametrize(
    ("mine", "unknown"), [(100.0, 100.0), (100.0, 20.0), (-100.0, 150.0), (100.0, 0.0)]
)
def test_an_effect_that_is_there_stays(mine: float, unknown: float) -> None:
    """Beside another one of any size, and where nothing remains."""
    assert redundant(*after(mine, unknown)) is None


def test_a_free_shape_of_its_own_law_does_not_count_against_an_effect() -> None:
    """A spring that hardens leaves a force over the position: that is its law."""
    name = "load_spring"
    assert redundant(*after(0.0, 100.0, name, LOAD)) is not None
    straight, aside = waves()
    search, found = after(0.0, 100.0, name, LOAD)
    term = found.terms[0]
    found.terms[0] = DiscrepancyTerm(
        LOAD, "position", term.statistic, term.limit, term.knots, term.curve,
        np.column_stack([straight, aside]),
    )  # fmt: skip
    assert redundant(search, found) is None


def test_a_search_goes_on_at_another_part() -> None:
    """Errors of one sensor, and effects of one stage of the model, stand for each other."""

    def same(one: str, other: str) -> bool:
        return COORDINATES[one].stage == COORDINATES[other].stage

    assert same("pressure_a.offset", "pressure_a.gain_error")
    assert not same("pressure_a.offset", "pressure_b.offset")
    assert not same("pressure_a.offset", "load_spring")
    assert same("load_spring", "wall")
    assert not same("load_spring", "backlash")


def test_what_is_set_aside_is_remembered_with_the_reason() -> None:
    """The report says of every name what became of it, and the model goes without it."""
    search, found = after(0.0, 100.0)
    search.final = found.base
    search.remove("supply_pressure.gain_error", "explains nothing")
    assert not search.effects
    assert not len(search.at)
    assert not search.final.coordinates
    assert search.dropped == {"supply_pressure.gain_error": "explains nothing"}
