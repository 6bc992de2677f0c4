"""A lag shorter than a sample is told in its true size."""

import numpy as np
from rig_data import INSTRUMENTS, knee_model, recorded

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer import Observer
from hil_emulator.identify.prediction.parameters import ordinary


def test_a_pressure_sensors_lag_of_half_a_sample_is_estimated() -> None:
    """0.5 ms, hidden in a recording with 1 ms between rows, is within twice its deviation."""
    model = knee_model()
    hidden = {"pressure_a": {"lag_time_constant": 5e-4}}
    data = [recorded({}, kind, 3, sensors=hidden) for kind in ("multisine", "steps")]
    lag = next(e for e in model.effects if e.name == "lag")
    free = [*ordinary(model), model.knob(lag, "pressure_a", np.inf)]
    fitter = Fitter(Observer(model, INSTRUMENTS), data)
    at = np.zeros(len(free))
    for _ in range(2):
        fitter.freeze(free, at)
        fit = fitter.fit(free, at, 5)
        at = fit.at
    found = free[-1].value(float(fit.at[-1]))
    deviation = free[-1].scale * np.sqrt(fit.covariance()[-1, -1])
    print(f"{found * 1e3:.3f} ± {deviation * 1e3:.3f} ms")
    assert deviation < 1e-4
    assert abs(found - 5e-4) < 2.0 * deviation
