"""The text of the compiled module: stages composed of their effects, then the balances."""

import inspect
import math
from collections.abc import Iterable, Mapping, Sequence

from hil_emulator.model import actuator, digits, exchange, integrator, leg, sensors, set_points
from hil_emulator.model.declare import Argument, DeclarationError, Effect, Law, Stage
from hil_emulator.model.layout import base_fields
from hil_emulator.model.stages import ACTS, CONTINUOUS, SAMPLED, TICKED

BALANCES = (
    *actuator.BALANCES, *leg.LEG, *exchange.EXCHANGE, *integrator.INTEGRATOR,
    *set_points.SET_POINTS, sensors.sample,
    *digits.DIGITS,
)  # fmt: skip

SINGLE_CALLER = (integrator.integrate, set_points.pass_set_points)
"""Functions with a single caller, see `compiling.merged`."""

_HEADER = '''"""Stages, balances and sensor chain, composed by hil_emulator.model.compose."""


import math
from typing import Any

from hil_emulator.model.constants import (
    ACTUATORS, ATMOSPHERE, DISCHARGE, FASTEST_SLIP, GAS_REACH, GAS_STRIDE, GRAVITY,
    LEAST_GAS_PRESSURE, LEAST_OPENING, LIGHTEST_ROD, PIECES, SLIDING_BEND, VELOCITY_DOUBT,
)
from hil_emulator.model.digits import COUNT, NOT_FINITE, WORD_LENGTH
from hil_emulator.model.integrator import Work
from hil_emulator.model.array_memory import BYTE, FLOAT, WHOLE
from hil_emulator.model.sensors import Transducers
'''

# Python passes plain float arrays, because unpacking records takes microseconds. They hold one
# record for each actuator on a supply. The memory of an integration is copied to the stack and
# back, see `array_memory`.
_ENTRIES = '''@compiled
def fill_all(parameters, par):
    """Copy the parameters of all actuators."""
    copies = as_floats(parameters)
    for i in range(len(copies)):
        copies[i] = par[i]


@compiled
def prepare_all(states, parameters, inputs, held):
    """Fill the values that are constant during a call of the integrator."""
    given = view(inputs, INPUTS)
    for i in range(ACTUATORS):
        prepare_step(states[i], parameters[i], given[i], held[i])


@compiled
def delay_all(parameters, past, held, step, steps):
    """Find the set points that reach each valve within a tick."""
    before = view(past, PAST)
    for i in range(ACTUATORS):
        await_set_point(parameters[i], held[i], before[i], step, steps)


@merged
def pass_given(memory, past, parameters, inputs, y, path, step, steps):
    """Integrate one tick with delayed set points; return whether the states are finite."""
    held = stack_array(ACTUATORS, HELD)
    work = Work(
        stack_array(ACTUATORS, STATE), stack_array(ACTUATORS, STATE), stack_array(ACTUATORS, STATE),
        stack_array(ACTUATORS, STATE), stack_array(ACTUATORS, STATE),
    )
    state = as_floats(work.states)
    for i in range(STATE_LENGTH * ACTUATORS):
        state[i] = memory[i]
    prepare_all(work.states, parameters, inputs, held)
    delay_all(parameters, past, held, step, steps)
    pass_set_points(work, parameters, held, y, path, step, steps)
    for i in range(STATE_LENGTH * ACTUATORS):
        memory[i] = state[i]
    return finite(state)


@noinline
def pass_tick(memory, past, par, inputs, signals, path, step, steps):
    """Integrate one tick: see `pass_given`."""
    parameters, y = stack_array(ACTUATORS, PARAMETERS), stack_array(ACTUATORS, SIGNALS)
    results = as_floats(y)
    fill_all(parameters, par)
    sound = pass_given(memory, past, parameters, inputs, y, path, step, steps)
    for i in range(SIGNALS_LENGTH * ACTUATORS):
        signals[i] = results[i]
    return sound


@entry_point
def tick(memory, past, par, inputs, signals, path, step, steps):
    """Integrate one tick: see `pass_tick`."""
    return pass_tick(memory, past, par, inputs, signals, path, step, steps)


@entry_point
def rate(state, rates, par, inputs, signals):
    """Evaluate every balance and every signal of all actuators on a supply."""
    states, parameters = view(state, STATE), view(par, PARAMETERS)
    held = stack_array(ACTUATORS, HELD)
    prepare_all(states, parameters, inputs, held)
    evaluate(states, view(rates, STATE), parameters, held, view(signals, SIGNALS))


@entry_point
def sense(signals, path, par, memory, past, normal, period, reading, overrange):
    """Sample: `sensors.sample` on views of flat memory."""
    chain = Transducers(view(par, CHANNEL), view(memory, MEMORY), view(past, CHANNEL_PAST))
    sample(signals, path, WIRING, chain, normal, period, reading, overrange)


@compiled
def read_all(
    par, memory, past, normal, period, reading, overrange, words, record, signals, path, count, time
):
    """Sample, and pack the digits of digital instruments."""
    chain = Transducers(view(par, CHANNEL), view(memory, MEMORY), view(past, CHANNEL_PAST))
    sample(signals, path, WIRING, chain, normal, period, reading, overrange)
    pack(reading, count, time, words, record)
    return range_code(overrange)


@entry_point
def report(
    par, memory, past, normals, period, reading, overrange, words, record, signals, path, row,
    count, time
):
    """Sample with a row of the normal numbers: see `read_all`."""
    return read_all(
        par, memory, past, normals[row], period, reading, overrange, words, record, signals, path,
        count, time,
    )


@allocating
def floats_at(places, k):
    """Return the numbers whose address and count are given in a row of places."""
    return array_at_address(places[k, 0], (places[k, 1],), FLOAT)


@entry_point
def tick_and_report(plant, instruments, step, steps, period, row, count, time):
    """Integrate one tick, and sample the only actuator with a row of the normal numbers."""
    signals = floats_at(plant, 4)
    path = array_at_address(plant[5, 0], (steps, ACTUATORS * CHANNEL_COUNT), FLOAT)
    sound = pass_tick(
        floats_at(plant, 0), floats_at(plant, 1), floats_at(plant, 2),
        floats_at(plant, 3), signals, path, step, steps,
    )
    if not sound:
        return NOT_FINITE
    if row < 0:
        return 0
    return report_at(instruments, signals, path, period, row, count, time)
'''

_REPORT_AT = '''@compiled
def report_at(instruments, signals, path, period, row, count, time):
    """Sample as `report`."""
    return read_all(
        floats_at(instruments, 0), floats_at(instruments, 1), floats_at(instruments, 2),
        array_at_address(instruments[3, 0], (instruments[3, 1], CHANNEL_COUNT), FLOAT)[row], period,
        floats_at(instruments, 4), array_at_address(instruments[5, 0], (CHANNEL_COUNT,), WHOLE),
        array_at_address(instruments[6, 0], (instruments[6, 1], WORD_LENGTH), FLOAT),
        array_at_address(instruments[7, 0], (instruments[7, 1],), BYTE), signals, path, count, time,
    )
'''

_NO_REPORT = '''@compiled
def report_at(instruments, signals, path, period, row, count, time):
    """Do nothing: the model has no effects of sensors."""
    return 0
'''


def function_name(effect: Effect, law: Law) -> str:
    """Return the name of a law's function in the module."""
    return effect.name if law.function is effect.law else f"{effect.name}_{law.stage.name}"


def record_name(effect: Effect, record: type) -> str:
    """Return the name in the module of a named tuple that a law of an effect takes."""
    return f"{effect.name}_{record.__name__}"


def _argument(name: Argument, effect: Effect, law: Law, base: frozenset[str]) -> str:
    """Return the expression of a law's argument in the generated code."""
    if not isinstance(name, str):
        fields = ", ".join(_argument(field, effect, law, base) for field in name.__annotations__)
        return f"{record_name(effect, name)}({fields})"
    takes = law.stage.takes
    if name in takes:
        return "value" if law.stage.compose == "chain" and name == takes[0] else name
    for param in effect.params:
        if param.name == name:
            return f"par.{effect.field_of(param)}"
    for state in effect.states:
        if state.name == name:
            return f"{'past' if state.length > 1 else 'x'}.{effect.field_of(state)}"
    if name in base:
        return f"par.{name}"
    offered = ", ".join(q.name for q in (*effect.params, *effect.states))
    raise DeclarationError(
        f"effect '{effect.name}' needs '{name}': stage '{law.stage.name}' offers "
        f"{', '.join(takes) or 'nothing'}; its own are {offered}"
    )


def _is_on(effect: Effect) -> str:
    off = "math.inf" if math.isinf(effect.off) else repr(effect.off)
    return f"par.{effect.field_of(effect.knob)} != {off}"


def _call_lines(effect: Effect, law: Law, base: frozenset[str]) -> list[str]:
    arguments = ", ".join(_argument(name, effect, law, base) for name in law.arguments)
    call = f"{function_name(effect, law)}({arguments})"
    compose = law.stage.compose
    rates = [f"dx.{effect.field_of(s)}" for s in law.returns]
    lines = [f"    if {_is_on(effect)}:"]
    if compose == "rates":
        return [*lines, f"        {', '.join(rates)} = {call}"]
    if rates and compose == "sum":
        return [*lines, f"        part, {', '.join(rates)} = {call}", "        value += part"]
    if rates:
        return [*lines, f"        value, {', '.join(rates)} = {call}"]
    return [*lines, f"        value {'+=' if compose == 'sum' else '='} {call}"]


def stage_source(stage: Stage, effects: Iterable[Effect], base: frozenset[str]) -> str:
    """Return the text of one stage's function."""
    takes = "".join(f", {name}" for name in stage.takes)
    past = "" if stage in CONTINUOUS else ", past"
    lines = [f"def {stage.name}(par, x, dx{past}{takes}):"]
    start = "0.0" if stage.compose != "chain" else stage.takes[0]
    lines += [f"    value = {start}"]
    for effect in effects:
        for law in effect.laws:
            if law.stage == stage:
                lines += _call_lines(effect, law, base)
    return "\n".join([*lines, "    return value", ""])


def stage_sources(
    stages: Iterable[Stage], effects: Sequence[Effect], base: frozenset[str]
) -> list[str]:
    """Return the text of the stages' functions.

    Stages without an effect and with the same number of arguments share one function, because each
    function takes as long to compile as a law.
    """
    acting = {law.stage for effect in effects for law in effect.laws}
    idle: dict[object, str] = {}
    parts = []
    for stage in stages:
        alike = len(stage.takes), stage.compose == "chain", stage in CONTINUOUS
        if stage not in acting and idle.setdefault(alike, stage.name) != stage.name:
            parts.append(f"{stage.name} = {idle[alike]}\n")
        else:
            parts.append(f"@compiled\n{stage_source(stage, effects, base)}")
    return parts


def acts_source(stage: Stage, effects: Iterable[Effect]) -> str:
    """Return the text of the function that returns whether any effect of a stage is on."""
    asked = [_is_on(e) for e in effects if any(law.stage == stage for law in e.laws)]
    return f"def {stage.name}_acts(par):\n    return {' or '.join(asked) or 'False'}\n"


def observe_source() -> str:
    """Return the text of the function that collects the channels' quantities, see `sensors`."""
    count = len(sensors.CHANNELS)
    lines = [
        f"        row[{count} * i + {k}] = y[i].{c.signal}" for k, c in enumerate(sensors.CHANNELS)
    ]
    return "\n".join(["def observe(y, row):", "    for i in range(ACTUATORS):", *lines, ""])


def _check_names(effects: Sequence[Effect], stages: Sequence[Stage]) -> None:
    taken = {s.name for s in stages} | {f.__name__ for f in BALANCES}
    for effect in effects:
        if effect.name in taken:
            raise DeclarationError(f"effect '{effect.name}' has the name of a stage or balance")
        for law in effect.laws:
            if law.stage not in stages:
                raise DeclarationError(f"effect '{effect.name}': no stage '{law.stage.name}'")


def module_source(effects: Sequence[Effect], constants: Mapping[str, float] | None = None) -> str:
    """Return the text of the whole module.

    Args:
        effects: of the model, in the order in which they act.
        constants: values that replace constants of `model.constants`.

    Raises:
        DeclarationError: if an effect needs a quantity that its stage does not offer.

    """
    stages = (*TICKED, *CONTINUOUS, *SAMPLED)
    _check_names(effects, stages)
    base = frozenset(base_fields())
    parts = [_HEADER, *(f"{name} = {value!r}" for name, value in (constants or {}).items())]
    parts += stage_sources(stages, effects, base)
    parts += [f"@compiled\n{acts_source(a.stage, effects)}" for a in ACTS]
    parts += [f"@compiled\n{observe_source()}"]
    for function in BALANCES:
        decorator = "merged" if function in SINGLE_CALLER else "compiled"
        parts += [f"@{decorator}\n{inspect.getsource(function)}"]
    senses = any(effect.name == "measuring_range" for effect in effects)
    return "\n\n".join([*parts, _ENTRIES, _REPORT_AT if senses else _NO_REPORT])
