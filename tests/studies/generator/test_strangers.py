"""Machines of other makers: their constants stand in no configuration."""

import ast
from pathlib import Path

import pytest

from hil_emulator.model.declare import Param
from hil_emulator.model.quantities import PARAMS
from tests.studies.generator.cases import UNSTATED

FOLDER = Path(__file__).parent
DRAWS = [f for f in FOLDER.glob("*.py") if not f.name.startswith("test_")]

MEASURED = "hil_emulator.identify.measured.experiment"
"""What a recording is: a container without a number of any machine."""


@pytest.mark.parametrize("file", DRAWS, ids=lambda file: file.stem)
def test_the_generator_takes_no_number_from_the_product(file: Path) -> None:
    """It imports the container of a recording from the package, and nothing else."""
    tree = ast.parse(file.read_text())
    modules = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module}
    modules |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert {m for m in modules if m.startswith("hil_emulator")} <= {MEASURED}


def declared(table: str, name: str) -> Param:
    """Return a declaration of the model."""
    return next(p for p in PARAMS[table] if p.name == name)


@pytest.mark.parametrize(
    ("drawn", "table", "name"),
    [
        ("shear", "friction", "presliding_distance"),
        ("slip_speed", "friction", "transition_velocity"),
    ],
)  # fmt: skip
def test_strangers_are_drawn_wider_than_declared_spreads(drawn: str, table: str, name: str) -> None:
    """The range of a constant reaches beyond one standard deviation on either side of a default."""
    param = declared(table, name)
    low, high = UNSTATED[drawn]
    assert param.spread is not None
    assert param.default is not None
    factor = 2.718281828**param.spread.size
    assert low < param.default / factor
    assert high > param.default * factor
