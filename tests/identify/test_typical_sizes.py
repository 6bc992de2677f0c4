"""Typical sizes of effects are those of the reference machine, and follow the size of another."""

from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import SPANS, Experiment
from hil_emulator.identify.prediction.benches.boundary import bounded
from hil_emulator.identify.prediction.instrumentation import examinable, predicting
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.platform.paths import shipped
from tests.identify.benches.asked import bench
from tests.identify.rig_data import CACHE

SIZED = {
    "coulomb_friction": 100.0, "viscous_friction": 1000.0, "internal_leakage": 1.7e-13,
    "land_leakage": 28e-6, "load_spring": 2e4,
}  # fmt: skip
"""Declared typical sizes, of a machine with 160 bar, 2.01 cm^2, 80 mm and 7.5 l/min at 10 mA."""


def knobs(*files: Path) -> dict[str, Coordinate]:
    """Return the candidates of a machine by name."""
    model = PlantModel(load(list(files)), CACHE)
    return {c.name: c for c in candidates(model, model.names)}


def test_the_reference_machine_has_the_declared_sizes() -> None:
    """To the last digit, bounds included."""
    for name, knob in knobs(shipped("configs/hyq_knee.toml")).items():
        assert knob.effect is not None
        declared, span = knob.effect.knob, SPANS[knob.channel] if knob.channel else 1.0
        times = span if declared.unit == "span" else 1.0
        off = knob.effect.off
        size = 1.0 / (declared.typical * times) if np.isinf(off) else declared.typical * times
        assert knob.scale == size, name
        assert (knob.low, knob.high) == (declared.low * times, declared.high * times)


def test_sizes_follow_force_flow_stroke_and_current(tmp_path: Path) -> None:
    """Twice the pressure and stroke, five times the area, four times the flow, and 25 mA."""
    large = tmp_path / "large.toml"
    large.write_text(
        '[supply]\npressure = "320 bar"\n'
        '[valve]\nnominal_flow = "21.213 l/min"\nrated_current = "25 mA"\n'
        'pressure_drop_total = "70 bar"\nnatural_frequency = "100 Hz"\n'
        '[cylinder]\npiston_area = "10.053 cm^2"\narea_ratio = 0.6\nstroke = "160 mm"\n'
        'dead_volume_a = "3 ml"\ndead_volume_b = "3 ml"\n'
        '[oil]\nbulk_modulus = "1300 MPa"\n[load]\nmass = "500 kg"\n'
    )
    force, flow, stroke = 10.0, 4.0, 2.0
    times = {
        "coulomb_friction": force, "viscous_friction": force / (flow / 5.0),
        "internal_leakage": flow / 2.0, "land_leakage": 2.5, "load_spring": force / stroke,
    }  # fmt: skip
    sizes = knobs(large)
    for name, declared in SIZED.items():
        assert sizes[name].scale == pytest.approx(times[name] * declared, rel=1e-6), name
    assert sizes["load_force.offset"].scale == pytest.approx(force * 50.0)
    assert sizes["position.offset"].scale == pytest.approx(stroke * 4e-4)


@pytest.mark.parametrize(("current", "litres", "size"), [(10, 0.13, 28e-6), (25, 0.66, 220e-6)])
def test_a_leakage_bench_goes_by_its_largest_flow(
    tmp_path: Path, current: int, litres: float, size: float
) -> None:
    """Edges of a new valve leak as those of the reference machine, worn ones by their flow.

    7.5 l/min pass an edge over 35 bar at the rated current, so 0.33 l/min over 80 bar at 0.029 of
    it; three tenths of that are usual.
    """
    config = tmp_path / "valve.toml"
    config.write_text(bench("valve_leakage").read_text().replace('"10 mA"', f'"{current} mA"'))
    loaded = load([config])
    wave = 1e-3 * np.sin(np.linspace(0.0, 9.0, 300))
    flow = np.full(300, litres / 6e4)
    logs = [Experiment("sweep", 0.5, wave, {"supply_flow": flow})]
    model = bounded(PlantModel(loaded, CACHE), loaded.bench)
    predictor, *_ = predicting(model, logs, [])
    assert predictor is not None
    sizes = {c.name: c.scale for c in examinable(predictor.model, predictor)}
    assert sizes["underlap"] == pytest.approx(size, rel=0.03)


def test_a_bench_of_forces_goes_by_its_largest_force() -> None:
    """Of a damper of 19 kN on a bench for 57 kN 1.8 kN are usual, as 100 N are of 3.2 kN."""
    config = load([bench("driven_axis")])
    wave = np.sin(np.linspace(0.0, 20.0, 500))
    readings = {"position": 0.1 + 0.02 * wave, "load_force": 19e3 * np.sign(np.gradient(wave))}
    logs = [Experiment("damper", 0.02, np.zeros(0), readings)]
    model = bounded(PlantModel(config, CACHE), config.bench)
    predictor, *_ = predicting(model, logs, [])
    assert predictor is not None
    sizes = {c.name: c.scale for c in examinable(predictor.model, predictor)}
    assert sizes["stribeck_friction"] == pytest.approx(1800.0)
    assert sizes["load_force.offset"] == pytest.approx(900.0)
