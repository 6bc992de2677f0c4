"""What a parameter, a state, a signal, a stage and an effect *are*.

A declaration is the single place where a quantity or an effect is defined. The compiled
simulator, the configuration's schema, the printed catalogue and the parametrised tests are all
derived from it.

    stage    a place in the equations where physics composes, such as the friction force
    effect   one physical law at one stage: a knob (its strength), shape parameters, states
    knob     has an `off` value at which the effect vanishes exactly: the kernel skips it
"""

import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

Compose = Literal["sum", "chain"]

# Attribute access on a record would find numpy's member instead of the field.
_RESERVED = frozenset(dir(np.record))


class DeclarationError(ValueError):
    """A declaration contradicts itself or another one."""


def _check_name(name: str) -> None:
    if not name.isidentifier() or name in _RESERVED:
        raise DeclarationError(f"'{name}' cannot name a field: numpy records use it themselves")


@dataclass(frozen=True)
class Quantity:
    """A named value of the model.

    Attributes:
        name: what the equations call it.
        unit: SI unit.
        meaning: one line for the reader of a table.

    """

    name: str
    unit: str
    meaning: str

    def __post_init__(self) -> None:
        _check_name(self.name)


@dataclass(frozen=True)
class Param(Quantity):
    """A quantity that stays constant during a run.

    Attributes:
        typical: the value of a usual machine, in `unit`.
        low: smallest allowed value, in `unit`.
        high: largest allowed value, in `unit`.
        shown: the unit engineers write it in, where that is not `unit`.
        default: value when the configuration says nothing; None makes it required.
        source: where the number comes from.

    """

    typical: float
    low: float
    high: float
    shown: str = ""
    default: float | None = None
    source: str = "assumed"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.low <= self.typical <= self.high:
            raise DeclarationError(
                f"{self.name}: typical {self.typical} is outside {self.low} ... {self.high}"
            )

    @property
    def display_unit(self) -> str:
        """The unit for people."""
        return self.shown or self.unit


@dataclass(frozen=True)
class Stage:
    """A place in the equations where effects compose.

    The balances call a stage by its name, `friction(par, x, dx, velocity, ...)`; the function of
    that name is what `kernel` makes of the stage's effects.

    Attributes:
        name: name of the generated function.
        table: the configuration table in which its effects are set.
        takes: names of the arguments that its effects may use.
        gives: what it computes.
        unit: SI unit of what it computes.
        compose: "sum" adds the effects up from zero; "chain" hands the first of `takes` through
            them one after the other.

    """

    name: str
    table: str
    takes: tuple[str, ...]
    gives: str
    unit: str
    compose: Compose

    def __call__(self, par: Any, x: Any, dx: Any, *takes: float) -> float:
        """Stand for the compiled stage where the balances call it."""
        raise TypeError(f"stage '{self.name}' runs only in the module that kernel.build makes")


@dataclass(frozen=True)
class Effect:
    """One physical law at one stage.

    Attributes:
        name: name of the law.
        stage: where it acts.
        knob: its strength; the first parameter.
        off: value of the knob at which the effect vanishes exactly.
        shape: further parameters, without meaning while the knob is off.
        states: what it integrates (or, in a sampled stage, remembers).
        law: the function; its arguments are resolved by name among the stage's `takes`, its own
            parameters and states, and the base parameters of the model.
        source: where the equation comes from.
        signature: which channel shows it, and where in the state space.
        not_modelled: where its validity ends.

    """

    name: str
    stage: Stage
    knob: Param
    off: float
    shape: tuple[Param, ...]
    states: tuple[Quantity, ...]
    law: Callable[..., Any]
    source: str
    signature: str
    not_modelled: str = ""
    arguments: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        names = tuple(inspect.signature(self.law).parameters)
        object.__setattr__(self, "arguments", names)
        own = [p.name for p in (*self.params, *self.states)]
        clash = set(own) & set(self.stage.takes)
        if clash or len(set(own)) < len(own):
            raise DeclarationError(f"{self.name}: a name is used twice: {sorted(clash or own)}")

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Evaluate the law in plain Python."""
        return self.law(*args, **kwargs)

    @property
    def params(self) -> tuple[Param, ...]:
        """The knob, then the shape parameters."""
        return (self.knob, *self.shape)

    @property
    def equation(self) -> str:
        """First line of the law's docstring."""
        return (inspect.getdoc(self.law) or "").partition("\n")[0].rstrip(".")

    def field_of(self, quantity: Quantity) -> str:
        """Name of the record field that holds one of its parameters or states."""
        return f"{self.name}_{quantity.name}"


def effect(
    stage: Stage,
    *,
    knob: Param,
    source: str,
    signature: str,
    off: float = 0.0,
    shape: Sequence[Param] = (),
    states: Sequence[Quantity] = (),
    not_modelled: str = "",
) -> Callable[[Callable[..., Any]], Effect]:
    """Declare the decorated function as the law of an effect.

    A law without states returns its contribution (stage "sum") or the new value (stage "chain").
    A law with states returns that and then one value per state: its rate of change or, in a
    sampled stage, its next value.
    """

    def declare(law: Callable[..., Any]) -> Effect:
        if not inspect.getdoc(law):
            raise DeclarationError(f"effect '{law.__name__}' has no docstring with its equation")
        return Effect(
            law.__name__, stage, knob, off, tuple(shape), tuple(states), law,
            source, signature, not_modelled,
        )  # fmt: skip

    return declare


def is_on(effect: Effect, value: float) -> bool:
    """Whether a knob at `value` lets the effect act."""
    return value != effect.off and not math.isnan(value)
