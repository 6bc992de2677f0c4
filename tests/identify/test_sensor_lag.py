"""How late a sensor is comes out in its true size, less than a sample or more."""

import numpy as np
import pytest
from rig_data import INSTRUMENTS, knee_model, recorded

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.parameters import ordinary


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "field", "channel", "true", "close"),
    [
        ("lag", "lag_time_constant", "pressure_a", 5e-4, 0.01),
        ("anti_aliasing", "anti_aliasing_cut_off", "pressure_a", 200.0, 0.005),
        ("delay", "delay_time", "pressure_a", 1e-3, 0.005),
        ("delay", "delay_time", "pressure_b", 2.5e-3, 0.005),
    ],
)
def test_how_late_a_pressure_sensor_is_comes_out(
    effect: str, field: str, channel: str, true: float, close: float
) -> None:
    """A lag of half a sample, a filter ahead of sampling, a delay: within twice its deviation.

    Rows are 1 ms apart.
    """
    model = knee_model()
    hidden = {channel: {field: true}}
    data = [recorded({}, kind, 3, sensors=hidden) for kind in ("multisine", "steps")]
    law = next(e for e in model.effects if e.name == effect)
    free = [*ordinary(model), model.knob(law, channel, np.inf)]
    fitter = Fitter(Observer(model, INSTRUMENTS), data)
    at = np.zeros(len(free))
    for _ in range(3):
        fitter.freeze(free, at)
        fit = fitter.fit(free, at, 5)
        at = fit.at
    deviation = np.sqrt(fit.covariance()[-1, -1])
    value, low, high = (free[-1].value(fit.at[-1] + d) for d in (0.0, -deviation, deviation))
    print(f"{value:.5g} ({low:.5g} to {high:.5g})")
    assert abs(high - low) < 2.0 * close * true
    assert abs(value - true) < abs(high - low)
