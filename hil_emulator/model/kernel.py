"""Compilation of the declared model to machine code, stored for later processes.

`build` compiles the module that `compose` writes. The folder's name is a digest of the model's
sources: numba's cache compares the age of one file only, and would load old code after a change in
another file.
"""

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np

from hil_emulator.model.array_memory import (
    array_at_address,
    as_floats,
    python_array_at_address,
    stack_array,
    view,
)
from hil_emulator.model.checked_cache import write_whole
from hil_emulator.model.compiling import allocating, entry_point, inlined, merged, noinline
from hil_emulator.model.compose import function_name, module_source, record_name
from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.layout import Vector, layouts, length, named, zeros
from hil_emulator.model.sensors import CHANNELS, wiring
from hil_emulator.model.stages import element

__all__ = ["Kernel", "Vector", "build", "keep", "named", "sources_digest", "zeros"]


@dataclass(frozen=True)
class Kernel:
    """The compiled model and the layout of its memory.

    All memory is flat float64 arrays; the record types name its fields. Actuators on one supply are
    consecutive in each array.

    Attributes:
        tick: `tick(memory, past, par, inputs, signals, path, step, steps)`: one tick of all
            actuators on a supply, see `integrator.integrate`, with the set points' delay; returns
            whether the states are finite.
        rate: `rate(state, rates, par, inputs, signals)`, see `exchange.evaluate`.
        sense: `sense(signals, path, par, memory, past, normal, period, reading, overrange)`,
            see `sensors.sample`.
        report: `report(par, memory, past, normals, period, reading, overrange, words, record,
            signals, path, row, count, time)`, see `sensors.sample` and `digits.pack`; returns
            `digits.range_code`.
        tick_and_report: `tick_and_report(plant, instruments, step, steps, period, row, count,
            time)`: both in one call; the arrays of `tick`, and those of `report` up to `record`,
            are given as `array_memory.addresses`. Without a report it returns 0 if `row` is
            negative, and `digits.NOT_FINITE` if a state is not finite.
        parameters: the plant's parameters.
        state: integrated states of the plant.
        past: stored values of the plant from tick to tick.
        inputs: commands and disturbances.
        held: constants during a call.
        signals: results of an evaluation.
        channel: the transducer parameters of one channel.
        memory: stored numbers of one channel.
        channel_past: stored samples of one channel.
        effects: the effects of the model.
        constants: values that replace constants of `model.constants`.
        actuators: number of actuators on the supply.
        source: text of the module.
        parts: objects of the module, by name.

    """

    tick: Callable[..., bool]
    rate: Callable[..., None]
    sense: Callable[..., None]
    report: Callable[..., int]
    tick_and_report: Callable[..., int]
    parameters: np.dtype[Any]
    state: np.dtype[Any]
    past: np.dtype[Any]
    inputs: np.dtype[Any]
    held: np.dtype[Any]
    signals: np.dtype[Any]
    channel: np.dtype[Any]
    memory: np.dtype[Any]
    channel_past: np.dtype[Any]
    effects: tuple[Effect, ...]
    constants: tuple[tuple[str, float], ...]
    actuators: int
    source: str
    parts: Mapping[str, Any] = field(compare=False, repr=False)


def sources_digest(effects: Iterable[Effect]) -> str:
    """Return a digest of all inputs of the machine code."""
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    files = {Path(inspect.getfile(law.function)) for e in effects for law in e.laws}
    files |= set(Path(__file__).parent.rglob("*.py"))
    # machine code refers to its source modules by name
    for name in sorted({str(law.function.__module__) for e in effects for law in e.laws}):
        digest.update(name.encode())
    # independent of the files' folder
    for content in sorted(file.name.encode() + file.read_bytes() for file in files):
        digest.update(content)
    return digest.hexdigest()[:16]


def keep(source: str, folder: Path, stem: str = "hil_emulator_kernel") -> Path | None:
    """Write a module into the cache; return None if that is not possible."""
    file = folder / f"{stem}_{hashlib.sha256(source.encode()).hexdigest()[:8]}.py"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not file.exists() or file.read_bytes() != source.encode():
            write_whole(file, source)
    except OSError:
        return None
    return file


def _unchanged(function: Any) -> Any:
    return function


def _as_floats(records: np.ndarray[Any, Any]) -> Vector:
    return records.view(np.float64)


@cache
def _compiled_law(function: Callable[..., Any]) -> Any:
    """Return a compiled law, shared by all models that use it.

    A user-defined effect may use a table, for which numba creates arrays.
    """
    return allocating()(function)


def _compilers(compiled: bool, file: Path | None) -> dict[str, Callable[..., Any]]:
    """Return the decorators of inner and entry functions, and the functions that create records."""
    if not compiled:
        return {
            "compiled": _unchanged,
            "merged": _unchanged,
            "allocating": _unchanged,
            "noinline": _unchanged,
            "entry_point": _unchanged,
            "view": np.ndarray.view,
            "stack_array": np.zeros,
            "as_floats": _as_floats,
            "array_at_address": python_array_at_address,
        }
    return {
        "compiled": inlined(),
        "merged": merged(),
        "allocating": allocating(),
        "noinline": noinline(),
        "entry_point": entry_point(file),
        "view": view,
        "stack_array": stack_array,
        "as_floats": as_floats,
        "array_at_address": array_at_address,
    }


def build(
    effects: Sequence[Effect] = CATALOGUE, cache: Path | None = None, compiled: bool = True,
    constants: Mapping[str, float] | None = None, actuators: int = 1,
) -> Kernel:  # fmt: skip
    """Compose and compile the model.

    Args:
        effects: of the model, in the order in which they act.
        cache: folder of machine code.
        compiled: False runs the same module as plain Python, some hundred times slower.
        constants: values that replace constants of `model.constants`.
        actuators: number of actuators on the supply, a constant of the machine code.

    Raises:
        DeclarationError: if an effect needs a quantity that its stage does not offer.

    """
    counted = {} if actuators == 1 else {"ACTUATORS": actuators}
    source = module_source(effects, {**(constants or {}), **counted})
    file = keep(source, cache / sources_digest(effects)) if cache and compiled else None
    # numba finds the functions through a module of this name
    module = ModuleType(file.stem if file else "hil_emulator_kernel")
    sys.modules[module.__name__] = module
    decorators = _compilers(compiled, file)
    law_of = _compiled_law if compiled else _unchanged
    types = layouts(effects)
    module.__dict__.update(decorators)
    for effect in effects:
        for law in effect.laws:
            module.__dict__[function_name(effect, law)] = law_of(law.function)
            records = {a for a in law.arguments if not isinstance(a, str)}
            module.__dict__.update({record_name(effect, record): record for record in records})
    module.__dict__.update({name.upper(): layout for name, layout in types.items()})
    module.__dict__.update({f"{n.upper()}_LENGTH": length(layout) for n, layout in types.items()})
    module.__dict__["CHANNEL_COUNT"] = len(CHANNELS)
    module.__dict__["ELEMENTS"] = sum(law.stage is element for e in effects for law in e.laws)
    module.__dict__["WIRING"] = wiring(types["signals"].names or ())
    exec(compile(source, str(file or "<kernel>"), "exec"), module.__dict__)
    return Kernel(
        tick=module.tick,
        rate=module.rate,
        sense=module.sense,
        report=module.report,
        tick_and_report=module.tick_and_report,
        effects=tuple(effects),
        constants=tuple((constants or {}).items()),
        actuators=actuators,
        source=source,
        parts=module.__dict__,
        **types,
    )
