"""Cylinders of other lengths than the reference machine's."""

import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE, INSTRUMENTS
from tests.studies.generator.benches import BENCHES


@pytest.mark.parametrize("bench", ["", "axis"])
def test_what_lies_along_the_stroke_is_usual_in_proportion(bench: str) -> None:
    """A spring rests in the middle of any cylinder, and a wall is met as far along."""
    stroke = BENCHES[bench].sheet["stroke"]
    model = PlantModel(load([BENCHES[bench].config]), CACHE)
    knobs = {c.name: c for c in candidates(model, INSTRUMENTS)}
    (rest,) = model.shapes(knobs["load_spring"])
    distance = model.shapes(knobs["wall"])[0]
    assert rest.neutral == pytest.approx(0.5 * stroke)
    assert distance.neutral == pytest.approx(0.625 * stroke)
