"""An FMU without a solver, integrated here with the integration steps of the configuration.

Between events the states follow the steps of `runge_kutta`. A step in which an event indicator
changes its sign is shortened to end just after the change. A step with a time event ends at that
event. Then the FMU stays in event mode until it requests no further discrete states.
"""

import ctypes
import math
from typing import Any

import numpy as np

from hil_emulator.fmi.importing.instance import Instance, check
from hil_emulator.fmi.importing.runge_kutta import accept, advance, attempt

Row = np.ndarray[Any, np.dtype[np.float64]]

_EVENTS = 100
"""Largest number of events within one integration step (assumed)."""

_HALVINGS = 40
"""Number of bisections of a step to locate an event: 2e-17 s for a step of 20 us."""


class ModelExchange(Instance):
    """An FMU for model exchange."""

    kind = "ModelExchange"

    def __init__(self, file: str, request: dict[str, Any], folder: str) -> None:
        super().__init__(file, request, folder)
        self._step: float = request["step"]
        self._steps: int = request["steps"]
        self._address = int(self.fmu.component)
        self._taken = 0
        self._time = 0.0
        self._next = math.inf
        states, indicators = self._sizes()
        self._rows = np.zeros((6, states))
        self._indicators = np.zeros((2, indicators))
        self._flags = np.zeros(2, np.int32)
        self._get_states = self.function("GetContinuousStates")
        self._get_indicators = self.function("GetEventIndicators")
        names = (
            "SetTime", "SetContinuousStates",
            "GetContinuousStateDerivatives" if self.three else "GetDerivatives",
            "GetEventIndicators", "CompletedIntegratorStep",
        )  # fmt: skip
        self._functions = tuple(_address(self.function(name)) for name in names)
        self._given = b""  # set inputs of zero, too: the FMU may start with others
        # initialisation ends in event mode
        self._leave_event_mode()
        self.get_outputs()

    def tick(self) -> None:
        """Integrate over a tick with the inputs held; a change of the inputs is an event."""
        if bytes(self.inputs) != self._given:
            self._given = bytes(self.inputs)
            self.fmu.enterEventMode()
            self.set_inputs()
            self._leave_event_mode()
        end = self._taken + self._steps
        while self._taken < end:
            self._take_whole_steps(end)
            if self._taken < end:
                self._taken += 1
                self._reach(self._taken * self._step)
        if not np.isfinite(self._rows[0]).all():
            raise RuntimeError("has a state that is no finite number")
        if np.isnan(self._indicators[0]).any():
            raise RuntimeError("has an event indicator that is no number")
        self.get_outputs()

    def _take_whole_steps(self, end: int) -> None:
        """Take steps up to the next step that contains an event or ends at a time event."""
        if self._next <= end * self._step:
            end = max(self._taken, min(end, math.ceil(self._next / self._step)) - 1)
        status, self._taken = advance(
            self._functions, self._address, self._step, self._taken, end, self._rows,
            self._indicators, self._flags,
        )  # fmt: skip
        self._time = self._taken * self._step
        self._check(status)
        self._answer(event=False)

    def _reach(self, end: float) -> None:
        """Integrate to a time, from event to event."""
        for _ in range(_EVENTS):
            stop, crossed = self._up_to_event(max(self._time, min(end, self._next)))
            self._check(
                accept(self._functions, self._address, self._rows, self._indicators, self._flags)
            )
            self._time = stop
            self._answer(event=crossed or stop >= self._next)
            if stop >= end:
                return
        raise RuntimeError(f"has over {_EVENTS} events within {self._step:g} s, at {end:g} s")

    def _up_to_event(self, stop: float) -> tuple[float, bool]:
        """Step to just after the first event; return the time, and whether there was an event."""
        if not self._attempt(stop):
            return stop, False
        before = self._time
        for _ in range(_HALVINGS):
            middle = 0.5 * (before + stop)
            if self._attempt(middle):
                stop = middle
            else:
                before = middle
        self._attempt(stop)
        return stop, True

    def _attempt(self, stop: float) -> bool:
        status, crossed = attempt(
            self._functions, self._address, self._time, stop, self._rows, self._indicators
        )
        self._check(status)
        return bool(crossed)

    def _answer(self, *, event: bool) -> None:
        """Enter event mode or end, if the FMU requested it after a step."""
        wanted, ends = self._flags
        self._flags[:] = 0
        if ends:
            self._end()
        if wanted or event:
            self.fmu.enterEventMode()
            self._leave_event_mode()

    def _leave_event_mode(self) -> None:
        """Update discrete states until they are constant, then continue with the new states."""
        update = self.fmu.updateDiscreteStates if self.three else self.fmu.newDiscreteStates
        for _ in range(_EVENTS):
            again, ends, _, _, scheduled, time = update()
            if ends:
                self._end()
            if not again:
                break
        else:
            raise RuntimeError(f"finds no end of its events at {self._time:g} s")
        # an event in the past, or at NaN, is due now
        self._next = max(self._time, time) if scheduled else math.inf
        self.fmu.enterContinuousTimeMode()
        self._fetch(self._get_states, self._rows[0], "reading its states")
        self._fetch(self._get_indicators, self._indicators[0], "reading its event indicators")

    def _sizes(self) -> tuple[int, int]:
        """Return the numbers of states and event indicators."""
        if self.three:
            states: int = self.fmu.getNumberOfContinuousStates()
            return states, self.fmu.getNumberOfEventIndicators()
        return self.description.numberOfContinuousStates, self.description.numberOfEventIndicators

    def _fetch(self, function: Any, row: Row, what: str) -> None:
        place = ctypes.c_void_p(row.ctypes.data)
        check(function(self.component, place, ctypes.c_size_t(row.size)), what)

    def _check(self, status: int) -> None:
        check(status, f"its integration from {self._time:g} s")

    def _end(self) -> None:
        raise RuntimeError(f"has ended its simulation at {self._time:g} s")


def _address(function: Any) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0
