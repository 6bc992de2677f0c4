"""An unexplained term as an effect file: a table over its regressor.

The file is an effect file in Python, which the user can change. A law may replace the table. Only
some balances have a place for such a term.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from hil_emulator.identify.conclusion.findings import Unexplained
from hil_emulator.identify.conclusion.term_places import place_of
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.balances import LOAD, PISTON
from hil_emulator.identify.prediction.free_terms.regressors import REGRESSORS
from hil_emulator.model.declare import Stage

_FILE = '''\
"""A term that no effect of the catalogue explains, estimated by `identify`.

{story}
The curve is a fit. Replace it once you know the law.
"""

import math

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import {stage}

KNOTS = ({knots},)
"""Values of the driver [{regressor_unit}]."""

VALUES = ({values},)
"""The term there [{unit}]."""

SLOPES = ({slopes},)
"""Its slope there; the curve never overshoots its values."""


@effect(
    {stage},
    knob=Param("factor", "1", "factor on the curve", 1.0, 0.0, 10.0, source="identification"),
    source="identification",
    signature="{signature}",
)
def {name}({arguments}, factor: float) -> float:
    """{equation}, T the fitted curve, constant beyond its ends."""
    z = min(max({regressor}, KNOTS[0]), KNOTS[-1])
    i = 0
    while i < len(KNOTS) - 2 and z > KNOTS[i + 1]:
        i += 1
    width = KNOTS[i + 1] - KNOTS[i]
    t = (z - KNOTS[i]) / width
    rise = VALUES[i + 1] - VALUES[i]
    start, end = width * SLOPES[i], width * SLOPES[i + 1]
    bend = (start - rise) * (1.0 - t) - (end - rise) * t
    term = factor * (VALUES[i] + rise * t + t * (1.0 - t) * bend)
    return {value}


EFFECTS = ({name},)
'''


@dataclass(frozen=True)
class EffectTable:
    """An effect file.

    Attributes:
        name: of the effect.
        stage: place in the model.
        text: of the file.
        words: description of the term.
        channel: its sensor; "" for the plant.

    """

    name: str
    stage: Stage
    text: str
    words: str
    channel: str = ""

    @property
    def table(self) -> str:
        """The table of the configuration that holds the effect."""
        return f"{self.stage.table}.{self.channel}" if self.channel else self.stage.table


def effect_table(
    term: Unexplained, taken: Sequence[str] = (), story: str = ""
) -> EffectTable | None:
    """Return an unexplained term as an effect file; None if the model has no place for it.

    Args:
        term: the unexplained term.
        taken: names of existing effects.
        story: origin of the term, for the head of the file.

    """
    place = place_of(term)
    if place is None:
        return None
    name = _name(term, taken)
    knots, values = np.array(term.knots), np.array(term.curve)
    slopes = PchipInterpolator(knots, values).derivative()(knots)
    text = _FILE.format(
        story=story or f"It acts on the {term.balance}: {term.shape}.", stage=place.stage.name,
        knots=_numbers(knots), values=_numbers(values), slopes=_numbers(np.asarray(slopes)),
        regressor_unit=REGRESSORS[term.regressor].unit, unit=term.unit,
        signature=f"{term.balance} over {term.regressor}", name=name,
        arguments=", ".join(f"{a}: float" for a in place.takes), equation=place.equation,
        regressor=place.regressor, value=place.value,
    )  # fmt: skip
    if "math." not in text:
        text = text.replace("import math\n\n", "")
    return EffectTable(name, place.stage, text, term.shape, place.channel)


def _name(term: Unexplained, taken: Sequence[str]) -> str:
    """Return an unused name."""
    balance = {PISTON.name: "friction", LOAD.name: "load"}.get(
        term.balance, term.balance.split()[0]
    )
    regressor = term.regressor.split(" with ")[0].replace(" ", "_")
    wanted = f"unexplained_{balance}_over_{regressor}"
    count, name = 1, wanted
    while name in taken:
        count += 1
        name = f"{wanted}_{count}"
    return name


def _numbers(values: Array) -> str:
    return ", ".join(repr(float(f"{v:.6g}")) for v in values)
