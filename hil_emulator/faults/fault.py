"""One fault as the user wrote it: checked, in SI, with its place in time."""

import contextlib
import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.faults.catalogue import KINDS
from hil_emulator.faults.connection import BUS, MESSAGE, MESSAGES, NODE
from hil_emulator.faults.declare import (
    SPAN,
    SPAN_PER_SECOND,
    TEXT,
    FaultKind,
    FaultParam,
    Layer,
)
from hil_emulator.faults.objects import EXAMPLE, OBJECT, place
from hil_emulator.faults.words import fault_words
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.signals import condition
from hil_emulator.signals.condition import Condition
from hil_emulator.units import read_as, show, to_si

_TIMES = ("start", "duration", "ramp")
OPTIONS = {
    "start": "earliest time at which it begins, counted from the injection, such as `2 s`",
    "duration": "how long it lasts, such as `500 ms`; without it until it is ended",
    "ramp": "time over which it grows to its full strength, such as `1 s`",
    "probability": "probability that it acts, per frame on the bus and per tick elsewhere",
    "seed": "seed of the random numbers for this probability",
    "condition": "it begins when this first holds, such as `position > 60 mm`",
}
"""Meaning of the options that every fault has besides the parameters of its kind."""

_OF_NODE = re.compile(r"node(\d{1,3})(?:\.(.+))?", re.ASCII)
_LONGEST_S = 1e9  # times of a fault: 32 years fit 64 bits of nanoseconds (assumed)
_LARGEST_SEED = 2**64 - 1
_CHANNELS = {c.name: c for c in CHANNELS}


@dataclass(frozen=True)
class Fault:
    """A fault: target, kind, parameters and time.

    Attributes:
        target: what fails.
        kind: of the fault.
        values: the kind's parameters, SI.
        start_ns: when it may begin, counted from its injection.
        duration_ns: how long it lasts from its beginning; None until it is ended.
        ramp_ns: time over which it grows to its full strength.
        probability: of its acting, per frame on the bus, per tick elsewhere.
        seed: of the random numbers.
        condition: it begins when this first holds.
        arguments: as the user gave them, for the record.
        node: the only node that it acts on; None for all.

    """

    target: str
    kind: FaultKind
    values: Mapping[str, Any]
    start_ns: int = 0
    duration_ns: int | None = None
    ramp_ns: int = 0
    probability: float = 1.0
    seed: int = 1
    condition: Condition | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    node: int | None = None

    @property
    def thing(self) -> str:
        """The target without its node, such as "tpdo1"."""
        return _thing(self.target)

    @property
    def words(self) -> str:
        """The fault with every value, also the default ones."""
        parts = []
        for param in self.kind.params:
            _, unit, shown = measure(self.target, self.kind, param)
            value = self.values[param.name]
            text = str(value) if param.unit == TEXT else show(value, unit, shown)
            parts.append(f"{param.name} {text}{'' if param.name in self.arguments else ' (usual)'}")
        parts += [f"{name} {self.arguments[name]}" for name in OPTIONS if name in self.arguments]
        return ", ".join([f"{self.target} {self.kind.name}", *parts])

    def __str__(self) -> str:
        return fault_words(self.target, self.kind.name, self.arguments)


def _thing(target: str) -> str:
    """Return a target without its node: "node5.tpdo1" is "tpdo1", "node5" is "node"."""
    match = _OF_NODE.fullmatch(target)
    return target if match is None else match[2] or NODE


def targets() -> list[str]:
    """Return all targets, objects by an example."""
    plain = {t for k in KINDS for t in k.targets if t not in (MESSAGE, BUS, NODE, OBJECT)}
    return [*_CHANNELS, *sorted(plain - _CHANNELS.keys()), BUS, NODE, *MESSAGES, EXAMPLE]


def kinds_of(target: str) -> dict[str, FaultKind]:
    """Return the kinds of fault that a target can have, by name."""
    name = _thing(target.lower())
    group = MESSAGE if name in MESSAGES or _is_cob_id(name) else OBJECT if place(name) else name
    possible = {k.name: k for k in KINDS if group in k.targets}
    if name == target.lower():
        return possible
    return {name: k for name, k in possible.items() if k.layer in (Layer.BUS, Layer.OBJECT)}


def fault(target: str, kind: str, /, **options: Any) -> Fault:
    """Return a checked fault.

    Args:
        target: a sensor channel, a part of the plant, "coil", "node", "bus", a message or an
            object such as "0x7130:1". Where several nodes are on the bus, "node5", "node5.tpdo1" or
            "node5.0x7130:1" means that of one of them.
        kind: one of those that the target can have.
        **options: parameters of the kind, and `start`, `duration`, `ramp` (times with unit),
            `probability`, `seed`, `condition`.

    Raises:
        UserError: for an unknown target, kind or option; lists those that exist.

    """
    for what in (target, kind, *options.values()):
        if not isinstance(what, str | int | float | None):
            raise UserError(f"fault: {brief(what)} is neither text nor a number")
    target, kind = str(target).lower(), str(kind)
    possible = kinds_of(target)
    if not possible and kinds_of(_thing(target)):
        raise UserError(
            f"fault {target}: a node has messages and objects only; write {_thing(target)}"
        )
    if not possible:
        raise UserError(f"fault: unknown target '{brief(target)}'{did_you_mean(target, targets())}")
    kind = brief(kind)
    if kind not in possible:
        raise UserError(f"fault: {target} cannot have '{kind}'{did_you_mean(kind, possible)}")
    chosen = possible[kind]
    names = [p.name for p in chosen.params]
    for key in options:
        if key not in (*names, *OPTIONS):
            hint = did_you_mean(key, [*names, *OPTIONS])
            raise UserError(f"fault {target} {kind}: no parameter '{brief(key)}'{hint}")
    values = {p.name: _value(target, chosen, p, options) for p in chosen.params}
    match = _OF_NODE.fullmatch(target)
    node = int(match[1]) if match else None
    common = _common(chosen, options)
    return Fault(target, chosen, values, arguments=dict(options), node=node, **common)


def spoken(text: str) -> Fault:
    """Return the fault of one line, such as `pressure_a offset value="3 bar" start="2 s"`.

    Raises:
        UserError: for a line that cannot be read, or an impossible fault.

    """
    try:
        target, kind, *rest = shlex.split(text)
        options = dict(word.split("=", 1) for word in rest)
    except ValueError:
        raise UserError(
            f"fault '{brief(text)}': write TARGET KIND and then NAME=VALUE, such as "
            "pressure_a offset value='3 bar' start='2 s'"
        ) from None
    return fault(target, kind, **options)


def _common(kind: FaultKind, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that every fault has."""
    times = {name: _time(name, options[name]) for name in _TIMES if name in options}
    common: dict[str, Any] = {f"{name}_ns": value for name, value in times.items()}
    probability = options.get("probability", kind.probability)
    try:
        common["probability"] = float(probability)
        common["seed"] = int(options.get("seed", 1))
    except (TypeError, ValueError, OverflowError):
        raise UserError("fault: probability and seed are plain numbers") from None
    if not 0.0 <= common["probability"] <= 1.0:
        raise UserError(f"fault: probability {brief(probability)} is not between 0 and 1")
    if not 0 <= common["seed"] <= _LARGEST_SEED:
        raise UserError("fault: the seed is not between 0 and 2^64 - 1")
    if options.get("condition"):
        common["condition"] = condition.parse(str(options["condition"]))
    return common


def _time(name: str, text: object) -> int:
    try:
        seconds = to_si(text, "s", "200 ms")
    except ValueError as error:
        raise UserError(f"fault: {name}: {error}") from None
    if not 0.0 <= seconds <= _LONGEST_S:
        raise UserError(
            f'fault: {name}: "{brief(text)}" is not a time from now on, at most {_LONGEST_S:g} s'
        )
    return round(seconds * 1e9)


def measure(target: str, kind: FaultKind, param: FaultParam) -> tuple[float, str, str]:
    """Return factor, SI unit and shown unit of a parameter.

    The default and the bounds of a sensor fault are parts of the channel's span.
    """
    channel = _CHANNELS.get(target) if kind.layer is Layer.SENSOR else None
    if channel is None or param.unit not in (SPAN, SPAN_PER_SECOND):
        return 1.0, param.unit, read_as(param.unit, param.shown or param.unit)
    rate = "/s" if param.unit == SPAN_PER_SECOND else ""
    unit = channel.unit + rate
    return channel.span, unit, read_as(unit, channel.shown + rate)


def twins(target: str) -> list[str]:
    """Return the channels that a channel can be exchanged with."""
    unit = _CHANNELS[target].unit
    return [c.name for c in CHANNELS if c.unit == unit and c.name != target]


def _value(target: str, kind: FaultKind, param: FaultParam, options: Mapping[str, Any]) -> Any:
    """Return a parameter in SI."""
    where = f"fault {target} {kind.name}: {param.name}"
    if param.unit == TEXT:
        return _twin(where, target, options.get(param.name))
    scale, unit, shown = measure(target, kind, param)
    example = show((param.default or 1.0) * scale, unit, shown)
    if param.name not in options:
        assert param.default is not None
        return param.default * scale
    # the amplitudes of a sensor's faults are differences of two readings
    difference = param.difference or param.unit == SPAN
    try:
        value = to_si(_plain(options[param.name], unit), unit, example, difference=difference)
    except ValueError as error:
        raise UserError(f"{where}: {error}") from None
    if not param.low * scale <= value <= param.high * scale:
        low, high = (show(v * scale, unit, shown) for v in (param.low, param.high))
        raise UserError(f"{where}: {brief(options[param.name])} is outside {low} ... {high}")
    return value


def _plain(text: object, unit: str) -> object:
    """Return a number, which may be hexadecimal if it has no unit."""
    if unit == "1" and isinstance(text, str) and text.lower().startswith("0x"):
        with contextlib.suppress(ValueError):
            return int(text, 16)
    return text


def _twin(where: str, target: str, other: object) -> str:
    if other not in twins(target):
        raise UserError(f"{where}: name one of {', '.join(twins(target))}, not {brief(other)}")
    return str(other)


def _is_cob_id(text: str) -> bool:
    try:
        return text.startswith("0x") and 0 <= int(text, 16) <= 0x7FF
    except ValueError:
        return False
