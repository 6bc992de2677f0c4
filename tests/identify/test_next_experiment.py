"""The next experiment: forecasts that come true, and a command that writes the file."""

import shlex
from functools import cache
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import spearmanr

from hil_emulator.__main__ import main
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design import forecast, next_experiment, practice
from hil_emulator.identify.experiment_design.forecast import Explanation, Forecaster
from hil_emulator.identify.experiment_design.library import LIBRARY, limits, stimulus, target
from hil_emulator.identify.experiment_design.next_experiment import (
    Candidate,
    NextExperiment,
    command,
    possible,
    recommend,
)
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, INSTRUMENTS, knee, knee_model, recorded


def test_separability_is_what_a_joint_refit_loses() -> None:
    """D of the information matrix is the residual sum of squares of a least-squares problem."""
    random = np.random.default_rng(1)
    difference, jacobian = random.standard_normal(200), random.standard_normal((200, 5))
    left = difference - jacobian @ np.linalg.lstsq(jacobian, difference, rcond=None)[0]
    columns = np.column_stack([difference, jacobian])
    assert forecast.separability(columns.T @ columns) == pytest.approx(left @ left, rel=1e-6)


def test_more_data_never_separate_less() -> None:
    """Information adds up: whatever is recorded besides, D does not fall."""
    random = np.random.default_rng(2)
    parts = [random.standard_normal((40, 6)) for _ in range(8)]
    total, last = np.zeros((6, 6)), 0.0
    for part in parts:
        total += part.T @ part
        assert forecast.separability(total) >= last - 1e-6
        last = forecast.separability(total)


@cache
def forecaster() -> Forecaster:
    """Return two explanations of one slow recording of a leaking machine."""
    model = knee_model()
    data = recorded({"internal_leakage_conductance": 1e-14}, "triangles", 1)
    observer = Observer(model, INSTRUMENTS)
    fitter = Fitter(observer, [data])
    free = parameters.ordinary(model)
    candidates_by_name = {c.name: c for c in parameters.candidates(model, INSTRUMENTS)}
    fitter.freeze(free, np.zeros(len(free)))
    explained = []
    for name, start in (("internal_leakage", 0.06), ("external_leakage", 0.3)):
        fit = fitter.fit(
            [*free, candidates_by_name[name]], np.append(np.zeros(len(free)), start), 4
        )
        explained.append(Explanation(name, fit.coordinates, fit.at, fit.chi2))
    fitter.freeze(explained[0].coordinates, explained[0].at)
    return Forecaster(fitter, observer, explained)


@pytest.mark.slow
def test_the_better_experiment_is_known_beforehand() -> None:
    """A small chirp around rest separates small leaks, steps hardly do: forecast and confirmed."""
    asked = forecaster()
    truth = asked.explanations[0]
    chirp, steps = (target(stimulus(n), limits(knee_model().plant_values))
                    for n in ("chirp", "steps"))  # fmt: skip
    assert asked.separability_of(truth, chirp) > 3.0 * asked.separability_of(truth, steps)
    assert asked.realised(chirp, truth, 5) > 3.0 * asked.realised(steps, truth, 5)


@pytest.mark.full(sibling="test_the_better_experiment_is_known_beforehand")
def test_forecasts_come_true() -> None:
    """Refits to new recordings rank experiments of little and much information as forecast.

    Motion below 1 mm is left out: its result depends on the noise of the recording.
    """
    asked = forecaster()
    truth = asked.explanations[0]
    allowed = limits(knee_model().plant_values)
    predicted, realised = [], []
    for name in ("multisine", "steps", "pseudo_random", "stroke", "chirp", "triangles"):
        played = target(stimulus(name), allowed)
        predicted.append(asked.separability_of(truth, played))
        realised.append(asked.realised(played, truth, 5))
    assert max(realised) > 5.0 * min(realised)
    assert spearmanr(predicted, realised).statistic > 0.8
    assert np.median(np.array(realised) / predicted) == pytest.approx(1.0, abs=0.5)


def test_every_experiment_is_considered_at_amplitudes_that_fit() -> None:
    """The whole library, at most at three amplitudes each, all within the stops."""
    plant = knee().plant
    targets = possible(plant, 1e-3)
    assert {t.stimulus.name for t in targets} == {e.name for e in LIBRARY}
    assert len(LIBRARY) < len(targets) <= 3 * len(LIBRARY)
    allowed = limits(plant)
    assert all(t.position.max() <= allowed.high + 1e-9 for t in targets)


def test_a_new_experiment_adds_to_what_is_known() -> None:
    """With any further recording the separability is at least that of the data there are."""
    asked = forecaster()
    played = target(stimulus("micro_motion"), limits(knee_model().plant_values))
    assert asked.separability(played) >= 0.9 * asked.now


def test_an_interrupt_ends_the_forecast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C during the forecast leaves the result without a recommendation."""
    truth, messages = forecaster().explanations[0], list[str]()
    search = Search([])
    search.final = Fit(truth.coordinates, truth.at, np.zeros(0), np.zeros((0, 0)), 0.0)
    searcher = Searcher(forecaster().fitter.predictor, forecaster().fitter.experiments, [], [], [])
    monkeypatch.setattr(next_experiment, "explanations", Mock(side_effect=KeyboardInterrupt))
    assert recommend(searcher, search, truth.name, ["external_leakage"], messages.append) is None
    assert "no experiment is recommended" in messages[-1]


PLAN = NextExperiment(
    ("internal_leakage", "external_leakage"), 4.0,
    Candidate("steps", 0.0126, 2.0, 90.0, 110.0), (Candidate("chirp", 0.001, 2.0, 7.0),),
    command(Candidate("steps", 0.0126, 2.0, 90.0), []),
)  # fmt: skip


def test_the_command_writes_the_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command in the sentence runs as it stands and writes what was recommended."""
    monkeypatch.chdir(tmp_path)
    assert PLAN.command in str(PLAN)
    program, *words = shlex.split(PLAN.command)
    assert program == "hil-emulator"
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    position = np.loadtxt(tmp_path / "steps.csv", delimiter=",", skiprows=1)[:, 1]
    assert len(position) == 2000
    assert np.abs(position - 0.04).max() == pytest.approx(0.0126, rel=1e-3)


def test_the_advice_states_that_no_experiment_helps() -> None:
    """A best candidate that would not separate is not recommended."""
    weak = Candidate("steps", 0.0126, 2.0, 90.0, 3.0)
    text = str(NextExperiment(PLAN.members, 1.0, weak, (), PLAN.command))
    assert "no experiment of the library would separate them" in text
    assert "hil-emulator" not in text


@pytest.mark.full(sibling="test_the_better_experiment_is_known_beforehand")
def test_a_result_with_a_group_states_what_to_record() -> None:
    """A gain error of a pressure that is never negative equals a different slope of one sign.

    No experiment separates these effects, as the plan and the sentence state.
    """
    model = knee_model()
    made = practice.ground(model, [practice.hide(model, "pressure_a.gain_error", "1 %")], 3)
    data = practice.campaign(made, ["multisine", "steps", "triangles"])
    result = identify(knee(), data[:2], data[2:], cache=CACHE)
    (finding,) = result.effects
    assert {finding.name, *finding.group} >= {"pressure_a.gain_error", "pressure_a.slope_asymmetry"}
    assert result.plan is not None
    assert "no experiment of the library would separate" in result.next_experiment
    kept = result.to_dict()["plan"]
    assert set(kept["members"]) <= {finding.name, *finding.group}
    assert kept["best"]["experiment"] in {e.name for e in LIBRARY}
