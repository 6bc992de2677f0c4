"""Compiled fixed-step Runge-Kutta method of order 4 for an FMU for model exchange.

The FMU's functions are called by address, with these arrays:

    functions   SetTime, SetContinuousStates, GetContinuousStateDerivatives, GetEventIndicators,
                CompletedIntegratorStep
    rows        states, trial states, four rates, shape (6, states)
    indicators  event indicators at the states and at the trial states, shape (2, indicators)
    flags       whether the FMU requests event mode, whether it requests the end, shape (2,)
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from hil_emulator.model.compiling import entry_point

_Function = TypeVar("_Function", bound=Callable[..., Any])

_inner = numba.njit(error_model="numpy")


def _entry(signature: Any) -> Callable[[_Function], _Function]:
    """Compile a function for one signature before its first call."""

    def compiled(function: _Function) -> _Function:
        dispatcher = entry_point(Path(__file__), _nrt=True)(function)
        dispatcher.compile(signature)
        return dispatcher  # type: ignore[no-any-return]

    return compiled


_types: Any = types
_INT, _REAL, _STATUS = _types.intp, _types.float64, _types.int32
_FUNCTIONS = _types.UniTuple(_INT, 5)
_ROWS = _REAL[:, ::1]
_FLAGS = _STATUS[::1]

_WARNING = 1
"""Largest status that is not an error."""


def _calling(_context: Any, address: Any, arguments: Any) -> Any:
    """Call a function of C by its address, with a tuple of arguments; return its status."""

    def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in arguments.types]
        function = ir.FunctionType(context.get_value_type(_STATUS), kinds)
        pointer = builder.inttoptr(given[0], function.as_pointer())
        return builder.call(
            pointer, [builder.extract_value(given[1], i) for i in range(len(kinds))]
        )

    return _STATUS(address, arguments), generate


_call: Any = intrinsic(_calling)


@_inner
def _vector(function: int, instance: int, values: Any) -> int:
    """Set states, or get rates or indicators."""
    return int(_call(function, (instance, np.intp(values.ctypes.data), values.size)))


@_inner
def _place(functions: Any, instance: int, time: float, states: Any) -> int:
    """Set the FMU's time and states."""
    status = _call(functions[0], (instance, time))
    return int(max(status, _vector(functions[1], instance, states)))


@_inner
def _rates(functions: Any, instance: int, time: float, states: Any, rates: Any) -> int:
    status = _place(functions, instance, time, states)
    return int(max(status, _vector(functions[2], instance, rates)))


@_inner
def _crossed(indicators: Any) -> bool:
    for i in range(indicators.shape[1]):
        if (indicators[0, i] > 0.0) != (indicators[1, i] > 0.0):
            return True
    return False


@_inner
def _attempt(
    functions: Any, instance: int, begin: float, end: float, rows: Any, indicators: Any
) -> int:
    step = end - begin
    states, trial, k_1, k_2, k_3, k_4 = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    middle = begin + 0.5 * step
    status = _rates(functions, instance, begin, states, k_1)
    trial[:] = states + 0.5 * step * k_1
    status = max(status, _rates(functions, instance, middle, trial, k_2))
    trial[:] = states + 0.5 * step * k_2
    status = max(status, _rates(functions, instance, middle, trial, k_3))
    trial[:] = states + step * k_3
    status = max(status, _rates(functions, instance, end, trial, k_4))
    trial[:] = states + step / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)
    status = max(status, _place(functions, instance, end, trial))
    return int(max(status, _vector(functions[3], instance, indicators[1])))


@_inner
def _accept(functions: Any, instance: int, rows: Any, indicators: Any, flags: Any) -> int:
    rows[0] = rows[1]
    indicators[0] = indicators[1]
    flags[:] = 0
    enter = np.intp(flags.ctypes.data)
    # argument 1: no state from before this time will be set again; the flag is passed in a
    # register, whose further bits the FMU does not read
    status: int = _call(functions[4], (instance, 1, enter, enter + flags.itemsize))
    return status


@_entry(_types.Tuple((_STATUS, _types.boolean))(_FUNCTIONS, _INT, _REAL, _REAL, _ROWS, _ROWS))
def attempt(
    functions: Any, instance: int, begin: float, end: float, rows: Any, indicators: Any
) -> tuple[int, bool]:
    """Take a step to the trial states, and set the FMU to them.

    Returns:
        The worst status of a function, and whether an indicator has changed its sign.

    """
    status = _attempt(functions, instance, begin, end, rows, indicators)
    return status, _crossed(indicators)


@_entry(_STATUS(_FUNCTIONS, _INT, _ROWS, _ROWS, _FLAGS))
def accept(functions: Any, instance: int, rows: Any, indicators: Any, flags: Any) -> int:
    """Accept the trial states and get the FMU's requests; return the status."""
    return _accept(functions, instance, rows, indicators, flags)


@_entry(_types.Tuple((_STATUS, _INT))(_FUNCTIONS, _INT, _REAL, _INT, _INT, _ROWS, _ROWS, _FLAGS))
def advance(
    functions: Any, instance: int, step: float, first: int, last: int, rows: Any, indicators: Any,
    flags: Any,
) -> tuple[int, int]:  # fmt: skip
    """Take the steps from `first * step` to `last * step`.

    It ends before a step in which an indicator changes its sign, or after a step at which the FMU
    requests event mode or the end.

    Returns:
        The worst status of a function, and the number of the last step.

    """
    for k in range(first, last):
        status = _attempt(functions, instance, k * step, (k + 1) * step, rows, indicators)
        if status > _WARNING or _crossed(indicators):
            return status, k
        status = _accept(functions, instance, rows, indicators, flags)
        if status > _WARNING or flags.any():
            return status, k + 1
    return 0, last
