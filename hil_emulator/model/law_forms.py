"""Differences between published forms of each base law and the model's form.

The model states each base law in one form. Another maker's valve, oil or seal may follow another
published form of the same law. The forms agree in the established range, and differ near singular
points. Identification does not report such a difference: it integrates it out, with the standard
deviations given here (`identify.prediction.observer.form_deviations`).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model.stages import PISTON

Array = NDArray[np.float64]
Terms = Mapping[str, Array]
"""By balance: contribution of one standard deviation of each shape, shape (samples, shapes). A
shape has the same amplitude in every balance."""


@dataclass(frozen=True)
class ModelRun:
    """A run of the model.

    Attributes:
        signals: along it, each of shape (samples,).
        configured: parameters that set the width of a difference; the parameters of a run follow a
            fit, which would change the width.

    """

    signals: Mapping[str, Array]
    configured: Mapping[str, float]


@dataclass(frozen=True)
class LawForm:
    """The published forms of one base law.

    Attributes:
        law: name of the law.
        balances: balances that contain its output.
        terms: difference of a run with another form.
        source: source of the forms.

    """

    law: str
    balances: tuple[str, ...]
    terms: Callable[[ModelRun], Terms]
    source: str


AT_REST = ((0.3, 0.5), (1.5, 0.5), (5.0, 0.1))
"""Widths over the transition velocity, and standard deviation of the friction there (assumed)."""

AFTER_REVERSAL = ((1.0, 1.0), (5.0, 0.5))
"""The same of widths over the presliding distance, after a reversal (assumed)."""


def friction_at_rest(run: ModelRun) -> Terms:
    """Return the difference in dry friction of another law at rest and after a reversal."""
    speed = np.abs(run.signals["velocity"]) / run.configured["friction_transition_velocity"]
    way = since_reversal(run.signals["position"], run.signals["velocity"])
    way = way / run.configured["friction_presliding_distance"]
    shapes = [share * np.exp(-speed / width) for width, share in AT_REST]
    shapes += [share * np.exp(-way / width) for width, share in AFTER_REVERSAL]
    return {PISTON: run.signals["friction_force"][:, None] * np.column_stack(shapes)}


def since_reversal(position: Array, velocity: Array) -> Array:
    """Return the distance of the rod from its last reversal [m]."""
    turns = np.diff(np.sign(velocity), prepend=np.sign(velocity[:1])) != 0.0
    last = np.maximum.accumulate(np.where(turns, np.arange(len(position)), 0))
    return np.abs(position - position[last])


FORMS = (
    LawForm("dry friction at rest and in reversal", (PISTON,), friction_at_rest,
            "tanh, Dahl, LuGre, Karnopp (Armstrong-Helouvry, Dupont and Canudas de Wit 1994)"),
)  # fmt: skip
"""Base laws whose published forms differ near a singular point."""


@dataclass(frozen=True)
class UsualEffect:
    """An effect that every machine has to some extent, but no data sheet states.

    Attributes:
        law: name of the base law that it refines.
        name: name of the effect.
        size: standard deviation of its knob, from the machine's parameters.
        source: source of the size.
        least: size below which nothing distinguishes it from other parameters, in standard
            deviations.

    """

    law: str
    name: str
    size: Callable[[Mapping[str, float]], float]
    source: str
    least: float = 0.0


THIRD_ORDER = 0.3
"""Additional time constant of the spool over that of its second order (assumed)."""

SHORTEST_LAG = 0.2
"""Part of the usual lag below which none is fitted. Like a change of the spool's frequency and
damping it delays, up to 0.5 % of the amplitude at 0.4 of the natural frequency; it would need steps
as short as itself."""


def _further_lag(plant: Mapping[str, float]) -> float:
    return THIRD_ORDER / (2.0 * math.pi * plant["valve_natural_frequency"])


USUAL = (
    UsualEffect("flow through an edge from laminar to turbulent", "series_resistance",
                lambda _: 0.7, "turbulent at any opening, by a critical Reynolds number (Merritt "
                "1967, 3.2), or with both drops in series (Borutzky et al. 2002)"),
    UsualEffect("stiffness of the oil", "modulus_pressure", lambda _: 15.0,
                "5 to 12 of oil alone, more with hoses (Gholizadeh et al. 2011)"),
    UsualEffect("stiffness of the oil", "entrained_air", lambda _: 0.003, "assumed: 0.1 to 1 %"),
    UsualEffect("dynamics of the spool", "driver_lag", _further_lag, "coil and driver",
                SHORTEST_LAG),
)  # fmt: skip
"""Effects that every machine has to a small extent."""
