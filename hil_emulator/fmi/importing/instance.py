"""An FMU loaded into this process."""

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

CO_SIMULATION, MODEL_EXCHANGE = "co-simulation", "model exchange"
"""Interfaces of an FMU: with a solver in the FMU, or for the solver of the importing tool."""


class Instance(ABC):
    """An FMU that is integrated tick by tick, without Python objects within a tick.

    Args:
        file: FMU file.
        request: see `worker`.
        folder: folder of the unpacked FMU.

    Attributes:
        fmu: FMPy's instance.
        inputs: inputs for the next tick, in the FMU's units.
        outputs: outputs at the present time, in the FMU's units.

    Raises:
        RuntimeError: if a function of the FMU fails; names the function and its status.

    """

    kind: ClassVar[str]
    """Name of the interface in FMPy."""

    def __init__(self, file: str, request: dict[str, Any], folder: str) -> None:
        import fmpy

        self.description: Any = fmpy.read_model_description(file)
        self.three = self.description.fmiVersion.startswith("3")
        self.fmu: Any = fmpy.instantiate_fmu(
            fmpy.extract(file, folder), self.description, self.kind
        )
        self.component = ctypes.c_void_p(self.fmu.component)
        self.inputs = (ctypes.c_double * len(request["inputs"]))()
        self.outputs = (ctypes.c_double * len(request["outputs"]))()
        self._set = self._access("Set", request["inputs"], self.inputs)
        self._get = self._access("Get", request["outputs"], self.outputs)
        self._initialise(request["parameters"])

    @abstractmethod
    def tick(self) -> None:
        """Set the inputs, integrate over a tick, and get the outputs.

        Raises:
            RuntimeError: if a function of the FMU fails; names the function and its status.

        """

    def function(self, name: str) -> Any:
        """Return a function of the FMU by its name without "fmi2" or "fmi3"."""
        return self.fmu.dll[f"fmi{3 if self.three else 2}{name}"]

    def set_inputs(self) -> None:
        """Set the inputs."""
        check(self._set(), "setting its inputs")

    def get_outputs(self) -> None:
        """Get the outputs."""
        check(self._get(), "reading its outputs")

    def _initialise(self, parameters: Sequence[tuple[int, float]]) -> None:
        if not self.three:
            self.fmu.setupExperiment(startTime=0.0)
        set_numbers = self.fmu.setFloat64 if self.three else self.fmu.setReal
        for reference, value in parameters:
            set_numbers([reference], [value])
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def _access(
        self, verb: str, references: Sequence[int], values: "ctypes.Array[ctypes.c_double]"
    ) -> Callable[[], int]:
        function = self.function(f"{verb}{'Float64' if self.three else 'Real'}")
        count = ctypes.c_size_t(len(references))
        given = (ctypes.c_uint * len(references))(*references)
        extra = [count] if self.three else []

        def access() -> int:
            if not references:
                return 0
            return int(function(self.component, given, count, values, *extra))

        return access


def check(status: int, what: str) -> None:
    """Raise if a function's status is an error.

    Raises:
        RuntimeError: for status 2 or higher; names the function and the status.

    """
    # 0 is OK, 1 a warning
    if status > 1:
        named = {2: "discarded", 3: "failed", 4: "failed fatally", 5: "did not end"}
        raise RuntimeError(f"{what} {named.get(status, f'ended with status {status}')}")
