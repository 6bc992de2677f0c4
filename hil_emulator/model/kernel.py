"""From declarations to machine code: record types and one compiled function per stage.

`build` writes one Python module - the stages composed of their effects, then the balances and the
sensor chain as they stand in their files - and compiles it. The module is kept in a folder named
by a digest of the model's sources: numba's own cache looks at the age of one file only and would
go on computing the old physics after an edit elsewhere.
"""

import hashlib
import inspect
import math
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np

from hil_emulator.model import actuator, sensors
from hil_emulator.model.declare import DeclarationError, Effect, Quantity, Stage
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.stages import CONTINUOUS, SAMPLED

# Plain float arrays cross the border from Python: records would cost microseconds to unpack there.
_ENTRIES = '''@entry
def run(memory, par, inputs, signals, step, steps):
    """Integrate: `actuator.integrate` on views of flat memory."""
    integrate(
        memory.view(STATE), memory, par.view(PARAMETERS)[0], inputs.view(INPUTS)[0],
        signals.view(SIGNALS)[0], step, steps,
    )


@entry
def rate(state, rates, par, inputs, signals):
    """Evaluate: `actuator.derivative` on views of flat memory."""
    derivative(
        state.view(STATE)[0], rates.view(STATE)[0], par.view(PARAMETERS)[0],
        inputs.view(INPUTS)[0], signals.view(SIGNALS)[0],
    )


@entry
def read(signals, sources, par, memory, normal, period, reading, overrange):
    """Sample: `sensors.sample` on views of flat memory."""
    sample(
        signals, sources, par.view(CHANNEL), memory.view(MEMORY), normal, period, reading,
        overrange,
    )
'''

Vector = np.ndarray[Any, np.dtype[np.float64]]

_HEADER = '"""Stages, balances and sensor chain, composed by hil_emulator.model.kernel."""\n'


def record_type(names: Sequence[str]) -> np.dtype[Any]:
    """Return a record type of float64 fields.

    Raises:
        DeclarationError: if two fields have the same name.

    """
    twice = {n for n in names if names.count(n) > 1}
    if twice:
        raise DeclarationError(f"declared twice: {', '.join(sorted(twice))}")
    return np.dtype((np.record, [(name, np.float64) for name in names]))


def _names(quantities: Iterable[Quantity]) -> list[str]:
    return [q.name for q in quantities]


def _own_fields(effects: Iterable[Effect], kind: str) -> list[str]:
    return [e.field_of(q) for e in effects for q in getattr(e, kind)]


@dataclass(frozen=True)
class Kernel:
    """The compiled model and the layout of its memory.

    All memory is flat float64 arrays; the record types give names to the same memory.

    Attributes:
        run: `run(memory, par, inputs, signals, step, steps)`, see `actuator.integrate`.
        rate: `rate(state, rates, par, inputs, signals)`, see `actuator.derivative`.
        read: `read(signals, sources, par, memory, normal, period, reading, overrange)`, see
            `sensors.sample`.
        parameters: the plant's parameters.
        state: what the plant integrates.
        inputs: commands and disturbances.
        signals: what an evaluation computes.
        channel: the transducer parameters of one channel.
        memory: what one channel remembers.
        effects: the effects that were compiled in.
        source: text of the module.

    """

    run: Callable[..., None]
    rate: Callable[..., None]
    read: Callable[..., None]
    parameters: np.dtype[Any]
    state: np.dtype[Any]
    inputs: np.dtype[Any]
    signals: np.dtype[Any]
    channel: np.dtype[Any]
    memory: np.dtype[Any]
    effects: tuple[Effect, ...]
    source: str


def named(vector: Vector, layout: np.dtype[Any]) -> Any:
    """Return the record that gives names to a flat vector's memory."""
    return vector.view(layout)[0]


def zeros(layout: np.dtype[Any], count: int = 1) -> Vector:
    """Return flat memory for `count` records of a layout."""
    return np.zeros(count * len(layout.names or ()))


def base_fields() -> list[str]:
    """Names of the parameters that every actuator has, as `table_name`."""
    return [f"{table}_{p.name}" for table, params in actuator.PARAMS.items() for p in params]


def _argument(name: str, effect: Effect, base: frozenset[str]) -> str:
    """Say where the generated code finds an argument of a law."""
    if name in effect.stage.takes:
        return (
            "value" if effect.stage.compose == "chain" and name == effect.stage.takes[0] else name
        )
    for kind, record in ((effect.params, "par"), (effect.states, "x")):
        for quantity in kind:
            if quantity.name == name:
                return f"{record}.{effect.field_of(quantity)}"
    if name in base:
        return f"par.{name}"
    raise DeclarationError(
        f"effect '{effect.name}' asks for '{name}': stage '{effect.stage.name}' offers "
        f"{', '.join(effect.stage.takes)}; its own are "
        f"{', '.join(_names((*effect.params, *effect.states)))}"
    )


def _call_lines(effect: Effect, base: frozenset[str]) -> list[str]:
    arguments = ", ".join(_argument(name, effect, base) for name in effect.arguments)
    call = f"{effect.name}({arguments})"
    own = [f"dx.{effect.field_of(s)}" for s in effect.states]
    adds = effect.stage.compose == "sum"
    off = "math.inf" if math.isinf(effect.off) else repr(effect.off)
    lines = [f"    if par.{effect.field_of(effect.knob)} != {off}:"]
    if own and adds:
        return [*lines, f"        part, {', '.join(own)} = {call}", "        value += part"]
    if own:
        return [*lines, f"        value, {', '.join(own)} = {call}"]
    return [*lines, f"        value {'+=' if adds else '='} {call}"]


def stage_source(stage: Stage, effects: Iterable[Effect], base: frozenset[str]) -> str:
    """Return the text of one stage's function."""
    start = "0.0" if stage.compose == "sum" else stage.takes[0]
    lines = [f"def {stage.name}(par, x, dx, {', '.join(stage.takes)}):", f"    value = {start}"]
    for effect in effects:
        if effect.stage == stage:
            lines += _call_lines(effect, base)
    return "\n".join([*lines, "    return value", ""])


def module_source(effects: Sequence[Effect]) -> str:
    """Return the text of the whole module."""
    base = frozenset(base_fields())
    parts = [_HEADER, "import math\nfrom typing import Any\n"]
    parts += [f"@compiled\n{stage_source(s, effects, base)}" for s in (*CONTINUOUS, *SAMPLED)]
    parts += [f"@compiled\n{inspect.getsource(f)}" for f in (*actuator.BALANCES, sensors.sample)]
    return "\n\n".join([*parts, _ENTRIES])


def sources_digest(effects: Iterable[Effect]) -> str:
    """Return a digest of everything the machine code depends on."""
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    files = {Path(inspect.getfile(e.law)) for e in effects}
    files |= set(Path(__file__).parent.rglob("*.py"))
    for file in sorted(files):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _keep(source: str, folder: Path) -> Path | None:
    """Write the module into the cache; None where that is not possible."""
    name = f"hil_emulator_kernel_{hashlib.sha256(source.encode()).hexdigest()[:8]}.py"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / name).exists():
            with tempfile.NamedTemporaryFile("w", dir=folder, delete=False) as file:
                file.write(source)
            os.replace(file.name, folder / name)
    except OSError:
        return None
    return folder / name


def _as_it_is(function: Any) -> Any:
    return function


def _compilers(compiled: bool, cached: bool) -> dict[str, Callable[[Any], Any]]:
    """Return the decorators of inner and entry functions."""
    if not compiled:
        return {"compiled": _as_it_is, "entry": _as_it_is}
    # numpy's error model: a division by zero gives inf as in C, without a branch
    return {
        "compiled": numba.njit(error_model="numpy"),
        "entry": numba.njit(error_model="numpy", cache=cached),
    }


def _layouts(effects: Iterable[Effect]) -> dict[str, np.dtype[Any]]:
    continuous = [e for e in effects if e.stage in CONTINUOUS]
    sampled = [e for e in effects if e.stage in SAMPLED]
    return {
        "parameters": record_type(base_fields() + _own_fields(continuous, "params")),
        "state": record_type(_names(actuator.STATES) + _own_fields(continuous, "states")),
        "inputs": record_type(_names(actuator.INPUTS)),
        "signals": record_type(_names(actuator.SIGNALS)),
        "channel": record_type(_own_fields(sampled, "params")),
        "memory": record_type(_own_fields(sampled, "states")),
    }


def build(
    effects: Sequence[Effect] = CATALOGUE, cache: Path | None = None, compiled: bool = True
) -> Kernel:
    """Compose and compile the model.

    Args:
        effects: the effects to know, in the order in which they act.
        cache: folder that keeps the machine code for the next start.
        compiled: False runs the same module as plain Python, some hundred times slower.

    Raises:
        DeclarationError: if an effect asks for something its stage does not offer.

    """
    source = module_source(effects)
    file = _keep(source, cache / sources_digest(effects)) if cache and compiled else None
    # numba finds the functions again through a module of this name
    module = ModuleType(file.stem if file else "hil_emulator_kernel")
    sys.modules[module.__name__] = module
    decorators = _compilers(compiled, cached=file is not None)
    layouts = _layouts(effects)
    module.__dict__.update(decorators)
    module.__dict__.update({e.name: decorators["compiled"](e.law) for e in effects})
    module.__dict__.update({name.upper(): layout for name, layout in layouts.items()})
    exec(compile(source, str(file or "<kernel>"), "exec"), module.__dict__)
    return Kernel(
        run=module.run,
        rate=module.rate,
        read=module.read,
        effects=tuple(effects),
        source=source,
        **layouts,
    )
