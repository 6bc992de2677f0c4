"""An instance of an FMU in FMPy, with variables by name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Run:
    """An FMU for co-simulation that has not been initialised yet."""

    def __init__(self, file: Path, folder: Path) -> None:
        import fmpy

        description = fmpy.read_model_description(str(file))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        unzipped = fmpy.extract(str(file), str(folder))
        self.fmu: Any = fmpy.instantiate_fmu(unzipped, description, "CoSimulation")
        self.three = description.fmiVersion.startswith("3")

    def begin(self, **parameters: float) -> None:
        """Initialise with other values of parameters; "." of a name is written "__"."""
        if not self.three:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.set(**parameters)
        self.fmu.exitInitializationMode()

    def set(self, **values: float) -> None:
        """Set variables."""
        given = [self.references[name.replace("__", ".")] for name in values]
        (self.fmu.setFloat64 if self.three else self.fmu.setReal)(given, list(values.values()))

    def get(self, *names: str) -> list[float]:
        """Read variables."""
        wanted = [self.references[name] for name in names]
        return list((self.fmu.getFloat64 if self.three else self.fmu.getReal)(wanted))

    def jacobian(self, unknowns: Sequence[str], knowns: Sequence[str]) -> NDArray[np.float64]:
        """Return partial derivatives by name, shape (unknowns, knowns)."""
        rows = [self.references[name] for name in unknowns]
        columns = [
            self.fmu.getDirectionalDerivative(rows, [self.references[name]], [1.0])
            for name in knowns
        ]
        return np.array(columns).T
