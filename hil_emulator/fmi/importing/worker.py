"""The process in which an FMU runs: whatever becomes of it, the bus is another one.

    python -m hil_emulator.fmi.importing.worker FILE REQUEST

REQUEST is JSON: value references of inputs and outputs, parameters, period. On standard input come
the values of the inputs, packed; on standard output go a status and the values of the outputs, one
answer ahead of the first step for the values at the start. It ends when the input does.
"""

import ctypes
import json
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from typing import Any

OK, FAILED = 0, 1
MESSAGE = 400
"""Bytes that a message may have; an answer ends with so many."""


class Stepper:
    """An FMU for co-simulation, stepped without Python objects in between.

    Args:
        file: the FMU.
        request: see the module.
        folder: where it is unpacked.

    """

    def __init__(self, file: str, request: dict[str, Any], folder: str) -> None:
        import fmpy

        description = fmpy.read_model_description(file)
        self._three = description.fmiVersion.startswith("3")
        self._period: float = request["period"]
        self.fmu: Any = fmpy.instantiate_fmu(
            fmpy.extract(file, folder), description, "CoSimulation"
        )
        self._component = ctypes.c_void_p(self.fmu.component)
        self.inputs = (ctypes.c_double * len(request["inputs"]))()
        self.outputs = (ctypes.c_double * len(request["outputs"]))()
        self._set = self._access("Set", request["inputs"], self.inputs)
        self._get = self._access("Get", request["outputs"], self.outputs)
        self._do_step = self._function("DoStep")
        self._time = 0.0
        self._ticks = 0
        self._begin(request["parameters"])

    def _begin(self, parameters: Sequence[tuple[int, float]]) -> None:
        if not self._three:
            self.fmu.setupExperiment(startTime=0.0)
        set_numbers = self.fmu.setFloat64 if self._three else self.fmu.setReal
        for reference, value in parameters:
            set_numbers([reference], [value])
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self._check(self._get(), "reading its outputs")

    def step(self) -> None:
        """Hand over the inputs, take a step, fetch the outputs.

        Raises:
            RuntimeError: says which of these failed, and how.

        """
        self._check(self._set(), "setting its inputs")
        # times are multiples, so that they never drift
        begin = self._ticks * self._period
        if self._three:
            flags = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
            status = self._do_step(
                self._component, ctypes.c_double(begin), ctypes.c_double(self._period),
                ctypes.c_bool(True), *flags, ctypes.byref(ctypes.c_double()),
            )  # fmt: skip
        else:
            status = self._do_step(
                self._component,
                ctypes.c_double(begin),
                ctypes.c_double(self._period),
                ctypes.c_int(1),
            )
        self._check(status, f"its step from {begin:g} s")
        self._ticks += 1
        self._check(self._get(), "reading its outputs")

    def _function(self, name: str) -> Any:
        return self.fmu.dll[f"fmi{3 if self._three else 2}{name}"]

    def _access(
        self, verb: str, references: Sequence[int], values: "ctypes.Array[ctypes.c_double]"
    ) -> Callable[[], int]:
        function = self._function(f"{verb}{'Float64' if self._three else 'Real'}")
        count = ctypes.c_size_t(len(references))
        given = (ctypes.c_uint * len(references))(*references)
        extra = [count] if self._three else []

        def access() -> int:
            if not references:
                return 0
            return int(function(self._component, given, count, values, *extra))

        return access

    @staticmethod
    def _check(status: int, what: str) -> None:
        # 0 is OK, 1 a warning
        if status > 1:
            named = {2: "discarded", 3: "failed", 4: "failed fatally", 5: "did not end"}
            raise RuntimeError(f"{what} {named.get(status, f'ended with status {status}')}")


def main(file: str, request: dict[str, Any]) -> None:
    """Serve until the input ends."""
    # what the FMU prints must not get among the answers
    answers = os.dup(1)
    os.dup2(2, 1)
    with tempfile.TemporaryDirectory() as folder:
        nothing = bytes(8 * len(request["outputs"]))
        try:
            stepper = Stepper(file, request, folder)
            os.write(answers, bytes([OK]) + bytes(stepper.outputs))
            while True:
                given = os.read(0, max(1, ctypes.sizeof(stepper.inputs)))
                if not given:
                    return
                ctypes.memmove(stepper.inputs, given, ctypes.sizeof(stepper.inputs))
                stepper.step()
                os.write(answers, bytes([OK]) + bytes(stepper.outputs))
        except Exception as error:  # the other process says it, whatever it is
            message = str(error).encode()[:MESSAGE].ljust(MESSAGE)
            os.write(answers, bytes([FAILED]) + nothing + message)


if __name__ == "__main__":
    main(sys.argv[1], json.loads(sys.argv[2]))
