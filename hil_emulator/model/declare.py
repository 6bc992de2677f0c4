"""Declarations: parameter, state, signal, stage and effect.

A declaration is the single place where a quantity or an effect is defined. The compiled simulator,
the configuration's schema, the printed catalogue and the parametrised tests are derived from it.

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

Compose = Literal["sum", "chain", "rates"]

ROUNDING = 1e-12
"""Relative error of unit conversion: several thousand roundings of a float64."""

# Attribute access on a record would find numpy's member instead of the field.
_RESERVED = frozenset(dir(np.record))


class DeclarationError(ValueError):
    """A declaration contradicts itself or another one."""


def _check_name(name: str) -> None:
    if not name.isidentifier() or name in _RESERVED:
        raise DeclarationError(f"'{name}' cannot name a field: it is a member of numpy records")


PARTS = ("lines", "driver")
"""Tables of parts whose presence in a machine is obvious, so they cannot be hidden effects."""


@dataclass(frozen=True)
class Quantity:
    """A named value of the model.

    Attributes:
        name: name in the equations.
        unit: SI unit.
        meaning: one line for tables.
        length: number of values that a sampled effect stores under this name, newest first.

    """

    name: str
    unit: str
    meaning: str
    length: int = field(default=1, kw_only=True)

    def __post_init__(self) -> None:
        _check_name(self.name)


@dataclass(frozen=True)
class Spread:
    """Spread among machines of a number that the configuration does not state.

    Attributes:
        size: standard deviation, of the natural logarithm or in the number's unit.
        logarithmic: whether `size` is that of the logarithm.

    """

    size: float
    logarithmic: bool = True


def factor(times: float) -> Spread:
    """Return the spread of a positive number: two thirds of machines are within the factor."""
    return Spread(math.log(times))


def within(size: float) -> Spread:
    """Return the spread of a number of either sign: two thirds of machines are within `size`."""
    return Spread(size, logarithmic=False)


SETTING = Spread(0.0)
"""Spread of a number that is chosen rather than measured, such as the flow at which a sheet states
a pressure drop: without an entry it is exactly the default."""


@dataclass(frozen=True)
class Param(Quantity):
    """A quantity that stays constant during a run.

    Attributes:
        typical: value of a usual machine, in `unit`.
        low: smallest allowed value, in `unit`.
        high: largest allowed value, in `unit`.
        shown: the unit that engineers write, if that is not `unit`.
        default: value without an entry in the configuration; None makes it required.
        source: origin of the number.
        off: value of a knob at which its effect vanishes exactly.
        along_stroke: whether it is a position along the stroke, which scales with the stroke of the
            cylinder; `typical` and `default` are those of the reference machine.
        spread: spread of machines about the default (assumed, unless `source` gives a range);
            required for a parameter with a default, except a knob, which is off by default.
        tolerance: relative standard deviation of a stated value (assumed: that of a careful data
            sheet); 0 for an exact value.
        power: exponent with which the influence of a number that may be 0 grows from 0.
        difference: whether a pressure is the difference of two, for which gauge units add nothing.

    """

    typical: float
    low: float
    high: float
    shown: str = ""
    default: float | None = None
    source: str = "assumed"
    off: float = field(default=0.0, kw_only=True)
    along_stroke: bool = field(default=False, kw_only=True)
    spread: Spread | None = field(default=None, kw_only=True)
    tolerance: float = field(default=0.0, kw_only=True)
    power: float = field(default=1.0, kw_only=True)
    difference: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.low <= self.typical <= self.high:
            raise DeclarationError(
                f"{self.name}: typical {self.typical} is outside {self.low} ... {self.high}"
            )

    @property
    def display_unit(self) -> str:
        """The unit in reports."""
        return self.shown or self.unit

    def allows(self, value: float) -> bool:
        """Return whether a value is within the bounds; NaN is not.

        A value may exceed a bound by the rounding of unit conversion.
        """
        slack = ROUNDING * abs(self.low), ROUNDING * abs(self.high)
        return self.low - slack[0] <= value <= self.high + slack[1]


@dataclass(frozen=True)
class Stage:
    """A place in the equations where effects compose.

    The balances call a stage by its name, `friction(par, x, dx, velocity, ...)`; `kernel` generates
    the function of that name from the stage's effects.

    Attributes:
        name: name of the generated function.
        table: the configuration table in which its effects are set.
        takes: names of the arguments that its effects may use.
        gives: the computed quantity.
        unit: SI unit of the computed quantity.
        compose: "sum" adds the effects; "chain" passes the first of `takes` through them in order;
            "rates" computes only rates of states whose values another stage has returned before.
        repeated: whether the balances call it several times at one state, as for each chamber;
            its effects cannot have states.
        balances: names of the balances on which its effects act; empty for a stage that only
            reads, or acts only through other stages.

    """

    name: str
    table: str
    takes: tuple[str, ...]
    gives: str
    unit: str
    compose: Compose
    repeated: bool = False
    balances: tuple[str, ...] = field(kw_only=True)

    def __call__(self, par: Any, x: Any, dx: Any, *takes: float) -> float:
        """Stand in for the compiled stage in the balances."""
        raise TypeError(f"stage '{self.name}' runs only in the module that kernel.build makes")


@dataclass(frozen=True)
class Acts:
    """`source_acts(par)` for stage `source`: whether any effect of the stage is on."""

    stage: Stage

    def __call__(self, par: Any) -> bool:
        """Stand in for the compiled function in the balances."""
        raise TypeError(f"'{self.stage.name}_acts' runs only in the module that kernel.build makes")


Argument = str | type[tuple[Any, ...]]
"""An argument of a law: its name, or the named tuple that it is."""


def _is_record(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, tuple)


@dataclass(frozen=True)
class Law:
    """A function at a stage.

    Attributes:
        stage: where it acts.
        function: its arguments are resolved by name among the stage's `takes`, the effect's
            parameters and states, and the base parameters of the model; for an argument annotated
            with a named tuple, each field is resolved.
        returns: the states whose rates (or next values) it returns after its value.

    """

    stage: Stage
    function: Callable[..., Any]
    returns: tuple[Quantity, ...] = ()

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """The function's arguments: a name, or a record whose fields are names."""
        parameters = inspect.signature(self.function).parameters.values()
        return tuple(p.annotation if _is_record(p.annotation) else p.name for p in parameters)


@dataclass(frozen=True)
class Effect:
    """One physical law, at one stage or, if necessary, at several.

    Attributes:
        name: name of the law.
        stage: where it acts.
        knob: its strength; the first parameter.
        shape: further parameters, without meaning while the knob is off.
        states: its integrated states (or, in a sampled stage, stored values).
        law: the function; its arguments are resolved by name among the stage's `takes`, its own
            parameters and states, and the base parameters of the model.
        source: origin of the equation.
        signature: the channel that shows it, and the region of the state space.
        not_modelled: limits of its validity.
        also: functions of the same effect at further stages.

    """

    name: str
    stage: Stage
    knob: Param
    shape: tuple[Param, ...]
    states: tuple[Quantity, ...]
    law: Callable[..., Any]
    source: str
    signature: str
    not_modelled: str = ""
    also: tuple[tuple[Stage, Callable[..., Any]], ...] = ()

    def __post_init__(self) -> None:
        names = [p.name for p in (*self.params, *self.states)]
        if len(set(names)) < len(names):
            raise DeclarationError(f"{self.name}: a name is used twice: {', '.join(sorted(names))}")
        for law in self.laws:
            clash = set(names) & set(law.stage.takes)
            if clash:
                raise DeclarationError(
                    f"{self.name}: stage '{law.stage.name}' already offers "
                    f"{', '.join(sorted(clash))}"
                )
            if law.returns and law.stage.repeated:
                raise DeclarationError(
                    f"{self.name}: stage '{law.stage.name}' is called several times at one state, "
                    "so it cannot have states"
                )

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Evaluate the law in plain Python."""
        return self.law(*args, **kwargs)

    @property
    def named(self) -> bool:
        """Whether identification may name it: its table is not in `PARTS`."""
        return self.stage.table not in PARTS

    @property
    def off(self) -> float:
        """Value of the knob at which the effect vanishes exactly."""
        return self.knob.off

    @property
    def params(self) -> tuple[Param, ...]:
        """The knob, then the shape parameters."""
        return (self.knob, *self.shape)

    @property
    def laws(self) -> tuple[Law, ...]:
        """The main law first; the rates of states come from a stage for rates if there is one."""
        scalars = tuple(q for q in self.states if q.length == 1)
        later = any(stage.compose == "rates" for stage, _ in self.also)
        laws = [Law(self.stage, self.law, () if later else scalars)]
        for stage, function in self.also:
            laws.append(Law(stage, function, scalars if stage.compose == "rates" else ()))
        return tuple(laws)

    @property
    def equation(self) -> str:
        """First line of the law's docstring."""
        return (inspect.getdoc(self.law) or "").partition("\n")[0].rstrip(".")

    @property
    def words(self) -> str:
        """The effect in one sentence: second paragraph of the docstring."""
        _, _, further = (inspect.getdoc(self.law) or "").partition("\n\n")
        words = " ".join(further.partition("\n\n")[0].split()).rstrip(".")
        return words[:1].lower() + words[1:]

    def field_of(self, quantity: Quantity) -> str:
        """Name of the record field that holds one of its parameters or states."""
        return f"{self.name}_{quantity.name}"


def effect(
    stage: Stage,
    *,
    knob: Param,
    source: str,
    signature: str,
    shape: Sequence[Param] = (),
    states: Sequence[Quantity] = (),
    not_modelled: str = "",
    also: Sequence[tuple[Stage, Callable[..., Any]]] = (),
) -> Callable[[Callable[..., Any]], Effect]:
    """Declare the decorated function as the law of an effect.

    A law without states returns its contribution (stage "sum") or the new value (stage "chain").
    A law with states returns that and then one value per state: its rate of change or, in a
    sampled stage, its next value. A state of several values arrives as an array, newest first,
    which the law shifts itself.

    `also` gives further (stage, function) pairs that share knob, shape and states. A function at
    a stage for rates returns the rates of the states, and the main law then returns only its value.
    So a state can act before the flow that drives it has been computed.
    """

    def declare(law: Callable[..., Any]) -> Effect:
        if not inspect.getdoc(law):
            raise DeclarationError(f"effect '{law.__name__}' has no docstring with its equation")
        return Effect(
            law.__name__, stage, knob, tuple(shape), tuple(states), law,
            source, signature, not_modelled, tuple(also),
        )  # fmt: skip

    return declare


def is_on(effect: Effect, value: float) -> bool:
    """Return whether the effect is on with its knob at `value`."""
    return value != effect.off and not math.isnan(value)
