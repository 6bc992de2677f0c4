"""Differences between published forms of each base law and the model's form.

The model states each base law in one form. Another maker's valve, oil or seal may follow another
published form of the same law. The forms agree in the established range, and differ near singular
points. Identification does not report such a difference: it integrates it out, with the standard
deviations given here (`identify.prediction.observer.form_deviations`).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model.servo_valve import transition
from hil_emulator.model.stages import FLOW_A, FLOW_B, PISTON

Array = NDArray[np.float64]
Terms = Mapping[str, Array]
"""By balance: contribution of one standard deviation of each shape, shape (samples, shapes). A
shape has the same amplitude in every balance."""


@dataclass(frozen=True)
class ModelRun:
    """A run of the model.

    Attributes:
        signals: along it, each of shape (samples,).
        plant: its parameters.
        configured: parameters that set the width of a difference; the parameters of a run follow a
            fit, which would change the width.

    """

    signals: Mapping[str, Array]
    plant: Mapping[str, float]
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


RESISTANCES_IN_SERIES = 0.2
"""Standard deviation of the interpolation from the model's form (0) to resistances in series (1)
(assumed: both forms are usual)."""


def laminar_transition(run: ModelRun) -> Terms:
    """Return the difference in flow for a laminar and a turbulent resistance in series.

    With x = u sqrt(dp) and s = T/x, the model passes q = K x (1 + s⁴)^(-1/4), resistances in series
    K x/(sqrt(1 + s²/4) + s/2). x follows from the flow of the model: x⁸ - (q/K)⁴ (x⁴ + T⁴) = 0.
    """
    now, usual = (max(transition(SimpleNamespace(**values), 1.0), 1e-12)
                  for values in (run.plant, run.configured))  # fmt: skip
    terms = {}
    for balance, name in ((FLOW_A, "flow_a"), (FLOW_B, "flow_b")):
        flow = run.signals[name]
        y = (flow / (run.plant["valve_gain"] * now)) ** 4
        s = np.maximum(0.5 * (y + np.sqrt(y * y + 4.0 * y)), 1e-24) ** -0.25
        whole, s = (1.0 + s**4) ** 0.25 * flow, s * usual / now
        narrow, usual_one, wide = (_in_series(part * s) for part in (1.0 / 3.0, 1.0, 3.0))
        shapes = usual_one - (1.0 + s**4) ** -0.25, wide - usual_one, narrow - usual_one
        change = np.column_stack(shapes)
        terms[balance] = RESISTANCES_IN_SERIES * whole[:, None] * change
    return terms


def _in_series(s: Array) -> Array:
    """Return the flow over the turbulent one."""
    return 1.0 / (np.sqrt(1.0 + 0.25 * s**2) + 0.5 * s)


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
    LawForm("flow through an edge from laminar to turbulent", (FLOW_A, FLOW_B), laminar_transition,
            "turbulent at any opening, by a critical Reynolds number (Merritt 1967, 3.2), or with "
            "the laminar and the turbulent drop in series (Borutzky et al. 2002)"),
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

    """

    law: str
    name: str
    size: Callable[[Mapping[str, float]], float]
    source: str


THIRD_ORDER = 0.3
"""Additional time constant of the spool over that of its second order (assumed)."""


def _further_lag(plant: Mapping[str, float]) -> float:
    return THIRD_ORDER / (2.0 * math.pi * plant["valve_natural_frequency"])


USUAL = (
    UsualEffect("stiffness of the oil", "modulus_pressure", lambda _: 15.0,
                "5 to 12 of oil alone, more with hoses (Gholizadeh et al. 2011)"),
    UsualEffect("stiffness of the oil", "entrained_air", lambda _: 0.003, "assumed: 0.1 to 1 %"),
    UsualEffect("dynamics of the spool", "driver_lag", _further_lag, "coil and driver"),
)  # fmt: skip
"""Effects that every machine has to a small extent."""
