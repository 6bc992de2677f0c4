"""Gain of a candidate that was refitted together with all parameters."""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.refits import CandidateRefits
from hil_emulator.identify.selection.scan import scan
from hil_emulator.identify.selection.search import Searcher
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded


def test_a_candidate_without_influence_has_no_gain() -> None:
    """For a cushion that the rod does not reach, the gain of the refit is not its gain."""
    model = knee_model()
    free = [c for c in parameters.ordinary(model) if c.name == "valve_gain"]
    searcher = Searcher(Observer(model, INSTRUMENTS), [recorded({}, "multisine", 7)], [], [], free)
    base = converge(searcher.fitter, free, np.zeros(1))
    (cushion,) = [c for c in parameters.candidates(model, INSTRUMENTS)
                  if c.name == "cushion"]  # fmt: skip
    (score,) = scan(searcher.fitter, base, [cushion])
    at, jacobian = np.append(base.at, 0.1), np.pad(base.jacobian, ((0, 0), (0, 1)))
    better = Fit([*free, cushion], at, base.residual, jacobian, base.chi2 - 100.0)
    trial = CandidateRefits(searcher.fitter, base, None, 20.0).evaluate(score, better)
    assert trial.evidence.delta_chi2 == 100.0
    assert trial.evidence.wald == 0.0
    assert not trial.evidence.passed
