"""Plant and sensors of one actuator as two files of C."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from hil_emulator.ccode.c_types import (
    INT,
    REAL,
    Numbers,
    Record,
    Records,
    Several,
    c_name,
    declared,
    record,
)
from hil_emulator.ccode.expressions import literal
from hil_emulator.ccode.program import Translation
from hil_emulator.model import quantities
from hil_emulator.model.declare import Effect
from hil_emulator.model.integrator import Work
from hil_emulator.model.kernel import Kernel, build
from hil_emulator.model.layout import fill
from hil_emulator.model.rest import STRETCHING, bearing_pressures, stretch_under, without_gas
from hil_emulator.model.sensors import CHANNELS, Transducers, wiring

_HERE = Path(__file__).parent
_COUNT = len(CHANNELS)


@dataclass(frozen=True)
class Exported:
    """An actuator to translate to C.

    Attributes:
        name: prefix of every public name; a valid identifier of C.
        title: one-line description.
        effects: effects of the model.
        values: parameters of the plant by record field, SI.
        sensors: transducer parameters by channel and record field, SI.
        step: integration step [s].
        steps: integration steps per tick.
        seed: seed of the sensors' noise.

    """

    name: str
    title: str
    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    sensors: Mapping[str, Mapping[str, float]]
    step: float
    steps: int
    seed: int = 0


def sources(actuator: Exported, *, single: bool = False) -> tuple[str, str]:
    """Return header and source file.

    Args:
        actuator: actuator to translate.
        single: whether to compute with float instead of double.

    Raises:
        TranslationError: if an effect's law cannot be translated to C.

    """
    kernel = build(actuator.effects, compiled=False)
    program = Translation(kernel, single=single)
    types = {name: record(f"{actuator.name}_{name}", getattr(kernel, name)) for name in _RECORDS}
    _translate(program, types, kernel)
    real = "float" if single else "double"
    common: dict[str, object] = {
        "name": actuator.name,
        "title": actuator.title.replace("*/", "* /"),
        "upper": actuator.name.upper(),
        "real": real,
        "f": "f" if single else "",
        "channels": _COUNT,
        "steps": actuator.steps,
        "period": literal(actuator.step * actuator.steps, single),
    }
    header: dict[str, object] = {
        "places": ", ".join(f"{actuator.name.upper()}_{c.name.upper()}" for c in CHANNELS),
        "records": "\n".join(
            _structure(r, real, _meanings(actuator.effects)) for r in types.values()
        ),
    }
    body: dict[str, object] = {
        "constants": _constants(program, literal(actuator.step, single)),
        "structures": "\n".join(_tuple(s, real) for s in program.structures.values()),
        "wiring": ",\n".join(_row(row, single) for row in wiring(kernel.signals.names or ())),
        "parameters": _initial(kernel.parameters, _filled(kernel, actuator.values), single, 1),
        "sensors": ",\n".join(_channel(kernel, actuator, c.name, single) for c in CHANNELS),
        "functions": "\n\n".join(program.texts),
        "noise": _noise(kernel),
        "stretching": _stretching(kernel),
        "seed": f"{actuator.seed}u",
        "turn": literal(2.0 * math.pi, single),
    }
    return (
        Template((_HERE / "plant.h.in").read_text()).substitute(common | header),
        Template((_HERE / "plant.c.in").read_text()).substitute(common | body),
    )


_RECORDS = (
    "parameters", "state", "past", "inputs", "held", "signals", "channel", "memory", "channel_past",
)  # fmt: skip
"""The model's records by their name in `Kernel`."""


def _translate(program: Translation, types: Mapping[str, Record], kernel: Kernel) -> None:
    """Translate the functions that `plant.c.in` calls."""
    par, held, state, y = (types[n] for n in ("parameters", "held", "state", "signals"))
    several = tuple(Records(r) for r in (state, state, par, held, y))
    memory = Numbers((kernel.state.itemsize // 8,))
    work = program.named_tuple(Work, [Records(state)] * len(Work._fields))
    path = Numbers((None, _COUNT))
    program.need("prepare_step", state, par, types["inputs"], held)
    program.need("await_set_point", par, held, types["past"], REAL, INT)
    program.need("evaluate", *several)
    program.need("pass_set_points", work, *several[2:], path, REAL, INT)
    program.need("finite", memory)
    program.need_function(bearing_pressures, *[REAL] * 5)
    program.need_function(stretch_under, *[REAL] * 4)
    program.need_function(without_gas, REAL, REAL)
    chain = [Records(types[n]) for n in ("channel", "memory", "channel_past")]
    transducers = program.named_tuple(Transducers, chain)
    signals = Numbers((len(y.fields),))
    wires = Numbers((_COUNT, 5), fixed=True)
    row = Numbers((_COUNT,))
    program.need(
        "sample", signals, path, wires, transducers, row, REAL, row, Numbers((_COUNT,), INT)
    )


def _filled(kernel: Kernel, values: Mapping[str, float]) -> np.ndarray[Any, Any]:
    return fill(kernel.parameters, kernel.effects, values)


def _channel(kernel: Kernel, actuator: Exported, name: str, single: bool) -> str:
    values = fill(kernel.channel, kernel.effects, actuator.sensors.get(name, {}))
    inner = _initial(kernel.channel, values, single, 2)
    return f"    {{ /* {name} */\n{inner}\n    }}"


def _initial(layout: np.dtype[Any], values: Iterable[float], single: bool, depth: int) -> str:
    """Return the initial values of a structure's members."""
    names = zip(layout.names or (), values, strict=True)
    lines = [f"{'    ' * depth}.{c_name(n)} = {literal(float(v), single)}," for n, v in names]
    return "\n".join(lines)


def _row(row: Iterable[float], single: bool) -> str:
    return f"    {{{', '.join(literal(float(v), single) for v in row)}}}"


def _noise(kernel: Kernel) -> str:
    """Return the statement that draws a channel's random number, if the channel has noise."""
    if "noise_sigma" not in (kernel.channel.names or ()):
        return "normals[i] = 0; /* no channel is noisy */"
    return "normals[i] = plant->sensors[i].noise_sigma != 0 ? normal(&plant->random) : 0;"


def _stretching(kernel: Kernel) -> str:
    """Return the arguments of `stretch_under` after the force."""
    names = kernel.parameters.names or ()
    return ", ".join(f"par->{name}" if name in names else "0" for name in STRETCHING)


def _constants(program: Translation, step: str) -> str:
    values = {"STEP": step, **program.constants}
    return "\n".join(f"#define {name} {value}" for name, value in sorted(values.items())) + "\n"


def _structure(made: Record, real: str, meanings: Mapping[str, str]) -> str:
    lines = ["typedef struct {"]
    for name, length in made.fields:
        size = f"[{length}]" if length > 1 else ""
        comment = f" /* {meanings[name]} */" if name in meanings else ""
        lines.append(f"    {real} {c_name(name)}{size};{comment}")
    return "\n".join([*lines, f"}} {made.name};", ""])


def _tuple(made: Several, real: str) -> str:
    members = [f"    {declared(kind, c_name(name), real)};" for name, kind in made.fields]
    return "\n".join(["typedef struct {", *members, f"}} {made.name};", ""])


def _meanings(effects: Iterable[Effect]) -> dict[str, str]:
    """Return unit and meaning of every field."""
    declarations = {
        q.name: q for q in (*quantities.ALL_STATES, *quantities.HELD, *quantities.SIGNALS)
    }
    tables = quantities.PARAMS.items()
    declarations |= {f"{table}_{p.name}": p for table, params in tables for p in params}
    declarations |= {e.field_of(q): q for e in effects for q in (*e.params, *e.states)}
    return {name: f"[{q.unit}] {q.meaning}" for name, q in declarations.items()}
