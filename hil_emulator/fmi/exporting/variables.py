"""The variables of an exported FMU, from the model's declarations.

They are named as in a configuration: `supply.pressure`, `friction.coulomb_friction.force`,
`sensors.position.noise.sigma`; signals of the model as in a recording, `model.position`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from hil_emulator.ccode.plant_source import Exported
from hil_emulator.model import quantities
from hil_emulator.model.declare import Effect, Param
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import fill
from hil_emulator.model.rating import rated_current, sized
from hil_emulator.model.sensors import CHANNELS, Channel

AT_START = "initial_position"
"""The parameter that acts at the start only."""


@dataclass(frozen=True)
class Variable:
    """A variable in the FMU's description.

    Attributes:
        name: name as in a configuration or a recording.
        reference: index among the numbers of the plant's structure.
        causality: "parameter", "input", "output", or "local" for states and their rates.
        variability: "fixed", "tunable" or "continuous".
        unit: SI unit.
        shown: display unit.
        description: meaning of the variable.
        start: start value; None for an output.
        low: smallest value; -inf without a bound.
        high: largest value; inf without a bound.
        is_state: whether the model integrates the variable.
        follows_states: whether the variable is a function of the present states.
        rate_of: reference of the state whose rate the variable is; None for other variables.

    """

    name: str
    reference: int
    causality: str
    variability: str
    unit: str
    shown: str
    description: str
    start: float | None = None
    low: float = -math.inf
    high: float = math.inf
    is_state: bool = False
    follows_states: bool = False
    rate_of: int | None = None


def variables(actuator: Exported, kernel: Kernel) -> list[Variable]:
    """Return all variables, in the order of the plant's structure."""
    listed = [*_parameters(actuator, kernel), *_transducers(actuator, kernel), *_inputs(kernel)]
    listed += _outputs(len(listed))
    return [*listed, *_states(kernel, len(listed))]


def _parameters(actuator: Exported, kernel: Kernel) -> Iterator[Variable]:
    starts = fill(kernel.parameters, kernel.effects, actuator.values)
    rated = rated_current(actuator.values)
    declared: dict[str, tuple[str, Param]] = {
        f"{table}_{p.name}": (f"{table}.{p.name}", sized(p, table, rated))
        for table, params in quantities.PARAMS.items()
        for p in params
    }
    declared |= {
        e.field_of(p): (_in_table(e, p), sized(p, e.stage.table, rated))
        for e in kernel.effects
        for p in e.params
    }
    for place, field in enumerate(kernel.parameters.names or ()):
        name, p = declared[field]
        start = float(starts[place])
        # what an effect that is off has besides is that of the reference's valve
        yield Variable(
            name, place, "parameter", "fixed" if field == AT_START else "tunable", p.unit,
            p.display_unit, p.meaning, start, min(p.low, start), max(p.high, start),
        )  # fmt: skip


def _in_table(effect: Effect, param: Param) -> str:
    return f"{effect.stage.table}.{effect.name}.{param.name}"


def _transducers(actuator: Exported, kernel: Kernel) -> Iterator[Variable]:
    place = len(kernel.parameters.names or ())
    declared = {e.field_of(p): (e, p) for e in kernel.effects for p in e.params}
    for channel in CHANNELS:
        values = fill(kernel.channel, kernel.effects, actuator.sensors.get(channel.name, {}))
        for field, start in zip(kernel.channel.names or (), values, strict=True):
            yield _transducer(channel, *declared[field], place, float(start))
            place += 1


def _transducer(
    channel: Channel, effect: Effect, param: Param, place: int, start: float
) -> Variable:
    of_channel = param.unit == "span"
    unit, scale = (channel.unit, channel.span) if of_channel else (param.unit, 1.0)
    return Variable(
        f"sensors.{channel.name}.{effect.name}.{param.name}", place, "parameter", "tunable", unit,
        channel.shown if of_channel else param.display_unit, param.meaning, start,
        param.low * scale, param.high * scale,
    )  # fmt: skip


def _inputs(kernel: Kernel) -> Iterator[Variable]:
    place = len(kernel.parameters.names or ()) + len(CHANNELS) * len(kernel.channel.names or ())
    for i, q in enumerate(quantities.INPUTS):
        yield Variable(
            q.name, place + i, "input", "continuous", q.unit, q.unit, q.meaning, start=0.0
        )


def _outputs(place: int) -> Iterator[Variable]:
    shown = {c.signal: c.shown for c in CHANNELS}
    for i, q in enumerate(quantities.SIGNALS):
        yield Variable(
            f"model.{q.name}", place + i, "output", "continuous", q.unit,
            shown.get(q.name, q.unit), q.meaning, follows_states=True,
        )  # fmt: skip
    place += len(quantities.SIGNALS)
    for i, c in enumerate(CHANNELS):
        meaning = f"what the sensor of {c.name.replace('_', ' ')} reports"
        yield Variable(c.name, place + i, "output", "continuous", c.unit, c.shown, meaning)


def _states(kernel: Kernel, place: int) -> Iterator[Variable]:
    declared = {q.name: q for q in quantities.ALL_STATES}
    declared |= {effect.field_of(q): q for effect in kernel.effects for q in effect.states}
    names = kernel.state.names or ()
    for i, name in enumerate(names):
        q = declared[name]
        yield Variable(
            f"state.{name}", place + i, "local", "continuous", q.unit, q.unit, q.meaning,
            is_state=True,
        )  # fmt: skip
    for i, name in enumerate(names):
        unit = _per_second(declared[name].unit)
        yield Variable(
            f"der(state.{name})", place + len(names) + i, "local", "continuous", unit, unit,
            f"rate of {name.replace('_', ' ')}", rate_of=place + i,
        )  # fmt: skip


def _per_second(unit: str) -> str:
    if unit in ("", "1"):
        return "1/s"
    return f"{unit}^2" if unit.endswith("/s") else f"{unit}/s"
