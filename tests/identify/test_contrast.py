"""Quantities to vary so that two effects are separated, from the arguments of their laws."""

import pytest

from hil_emulator.identify.experiment_design.contrast import contrast
from hil_emulator.model.effects import CATALOGUE

BY_NAME = {e.name: e for e in CATALOGUE}


@pytest.mark.parametrize(
    ("one", "other", "way"),
    [
        ("coulomb_friction", "pressure_friction", "at other chamber pressures"),
        ("coulomb_friction", "viscous_friction", "at other speeds, slower and faster"),
        ("coulomb_friction", "position_friction", "over the whole stroke"),
        ("stribeck_friction", "viscous_friction", "at other speeds, slower and faster"),
        ("pressure_friction", "stribeck_friction",
         "at other chamber pressures and at other speeds, slower and faster"),
    ],
)  # fmt: skip
def test_what_only_one_law_looks_at_is_varied(one: str, other: str, way: str) -> None:
    """Pressures, not strokes, part Coulomb friction from its growth with pressure."""
    assert contrast(BY_NAME[one], [BY_NAME[other]]) == way


def test_every_pair_has_an_answer() -> None:
    """Every pair of effects has an instruction that separates them."""
    assert all(contrast(a, [b]) for a in CATALOGUE for b in CATALOGUE)
