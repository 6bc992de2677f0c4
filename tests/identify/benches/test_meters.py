"""Flow meters of benches have the effects of every transducer."""

import numpy as np
import pytest
from scipy.signal import lfilter

from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import FLOWS, Experiment
from hil_emulator.identify.prediction.benches.boundary import bounded
from hil_emulator.identify.prediction.benches.meters import Meter, with_meters
from hil_emulator.identify.prediction.instrumentation import examinable, predicting
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.platform.paths import cache_folder
from tests.identify.benches.asked import bench

ERRORS = {"offset", "gain_error", "slope_asymmetry", "nonlinearity", "zero_drift"}
LATE = {"lag", "delay", "anti_aliasing", "creep"}


def readings(*names: str) -> dict[str, np.ndarray]:
    """Return moving readings of some channels."""
    wave = np.sin(np.linspace(0.0, 9.0, 400))
    return {n: 1e-5 * wave if n in FLOWS else 0.1 + 0.05 * wave if n == "position"
            else 80e5 + 1e5 * wave for n in names}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "given", "predicted"),
    [
        ("valve_flow", ("pressure_a",), ("flow_a",)),
        ("quasi_static_sweep", ("pressure_a",), ("flow_a",)),
        ("quasi_static_sweep", (), ("pressure_a", "pressure_b")),
        ("valve_leakage", (), ("supply_flow", "return_flow", "leakage_line_flow")),
        ("driven_axis", ("position",), ("load_force",)),
        ("force_balance", ("position", "pressure_a"), ("load_force",)),
    ],
)
def test_every_predicted_channel_has_the_errors_of_a_sensor(
    kind: str, given: tuple[str, ...], predicted: tuple[str, ...]
) -> None:
    """On every bench, those that take time included."""
    config = load([bench(kind)])
    model = bounded(PlantModel(config, cache_folder()), config.bench)
    values = readings(*given, *predicted)
    if kind == "force_balance":
        values["pressure_b"] = np.zeros(400)
    current = np.zeros(0) if "position" in given else 1e-3 * np.sin(np.linspace(0.0, 9.0, 400))
    predictor, *_, why = predicting(model, [Experiment("log", 0.01, current, values)], [])
    assert predictor is not None, why
    names = {c.name for c in examinable(predictor.model, predictor)}
    assert {f"{channel}.{e}" for channel in predicted for e in ERRORS | LATE} <= names


def test_a_meter_reads_as_its_transducer() -> None:
    """A gain, an offset and a first-order lag of a flow, by scipy's filter for a held flow."""
    model = with_meters(PlantModel(load([bench("valve_flow")]), cache_folder()), ("flow_a",))
    meter = Meter(model, "flow_a")
    flow = np.repeat([0.0, 2e-5, -1e-5], 300)
    assert np.array_equal(meter.reading(flow, model.chan, 0.01), flow)
    effects = {c.name: c for c in candidates(model, ("flow_a",))}
    chosen = [effects[f"flow_a.{name}"] for name in ("lag", "gain_error", "offset")]
    values = (0.5, 0.1, 3e-6)
    at = [c.at(value) for c, value in zip(chosen, values, strict=True)]
    _, chan = model.memory(chosen, at)
    # the element takes a quantity for linear within a sample: half a sample later
    kept = np.exp(-0.01 / 0.5)
    late = lfilter([1.0 - kept], [1.0, -kept], flow)
    expected = 1.1 * late + 3e-6
    assert meter.reading(flow, chan, 0.01) == pytest.approx(expected, abs=4e-7)
