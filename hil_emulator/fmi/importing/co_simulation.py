"""An FMU with a solver: a tick is a communication step."""

import ctypes
from typing import Any

from hil_emulator.fmi.importing.instance import Instance, check


class CoSimulation(Instance):
    """An FMU for co-simulation."""

    kind = "CoSimulation"

    def __init__(self, file: str, request: dict[str, Any], folder: str) -> None:
        super().__init__(file, request, folder)
        self._period: float = request["step"] * request["steps"]
        self._do_step = self.function("DoStep")
        self._event, self._ends, self._early = (ctypes.c_bool() for _ in range(3))
        self._reached = ctypes.c_double()
        self._ticks = 0
        self.get_outputs()

    def tick(self) -> None:
        """Take a communication step with the inputs held."""
        self.set_inputs()
        # times are multiples of the period, so that rounding errors do not add up
        begin = self._ticks * self._period
        times = ctypes.c_double(begin), ctypes.c_double(self._period)
        if self.three:
            results = self._event, self._ends, self._early, self._reached
            answers = [ctypes.byref(value) for value in results]
            status = self._do_step(self.component, *times, ctypes.c_bool(True), *answers)
        else:
            status = self._do_step(self.component, *times, ctypes.c_int(1))
        check(status, f"its step from {begin:g} s")
        if self._ends:
            raise RuntimeError(f"has ended its simulation at {self._reached.value:g} s")
        if self._early:
            raise RuntimeError(
                f"its step from {begin:g} s ended early, which it was not allowed to"
            )
        self._ticks += 1
        self.get_outputs()
