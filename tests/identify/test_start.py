"""First hundredths of a second of a recording, which depend on an unknown past."""

import numpy as np
import pytest

from hil_emulator.identify.prediction.observer.observer import BURN_IN, Observer
from hil_emulator.identify.prediction.plant.parameters import candidates, ordinary
from tests.identify.rig_data import INSTRUMENTS, knee_model
from tests.studies.generator.bench import record
from tests.studies.generator.cases import case, machine


@pytest.mark.parametrize("kind", ["chirp", "multisine", "steps"])
@pytest.mark.parametrize("off", [-1.0, 1.0])
def test_the_filter_settles_for_any_plausible_machine(kind: str, off: float) -> None:
    """With valve and oil off by one deviation, the first predictions are as good as later ones."""
    model = knee_model()
    observer = Observer(model, INSTRUMENTS)
    real = case("pairs", 2, 0.5)
    data = record(machine(real), dict(real.effects), kind, (1, 7), 0.5, True)
    free = [c for c in ordinary(model) if c.name in ("valve_gain", "oil_bulk_modulus")]
    par, chan = model.memory(free, [off, -off])
    innovations = observer.innovations(observer.freeze(data, par, chan), par, chan)[0]
    begin = round(BURN_IN / data.period)
    first = np.sqrt(np.mean(innovations[begin : begin + 100] ** 2))
    assert first < 2.0 * np.sqrt(np.mean(innovations[begin:] ** 2)) + 1.0


def test_friction_with_negative_slope_keeps_the_filter_stable() -> None:
    """With breakaway friction in the model, predictions stay bounded."""
    model = knee_model()
    observer = Observer(model, INSTRUMENTS)
    real = case("foreign", 10, 0.5)
    data = record(machine(real), dict(real.effects), "chirp", (1, 7), 0.5, False)
    hidden = next(c for c in candidates(model, INSTRUMENTS) if c.name == "stribeck_friction")
    par, chan = model.memory([hidden], [0.4])
    innovations = observer.innovations(observer.freeze(data, par, chan), par, chan)[0]
    assert np.max(np.abs(innovations)) < 20.0


def test_the_null_is_corrected_by_counted_samples_only() -> None:
    """Excluded samples do not correct the null drift; later ones do."""
    model = knee_model()
    observer = Observer(model, INSTRUMENTS)
    data = record(machine(case("none", 0, 0.3)), {}, "multisine", (1, 1), 0.3, False)
    gains = np.abs(observer.freeze(data, *model.memory([], [])).gains.kalman[:, -2]).max(axis=1)
    begin = round(BURN_IN / data.period)
    assert not gains[:begin].any()
    assert gains[begin:].all()
