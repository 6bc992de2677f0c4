"""The plant in C, compiled for this machine and called from Python, for tests and `bench`."""

import ctypes
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.ccode.compiler import CompilerError, build_library, host
from hil_emulator.ccode.plant_source import Exported, sources
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import length
from hil_emulator.model.sensors import CHANNELS

Array = np.ndarray[Any, np.dtype[Any]]


def memory_layout(kernel: Kernel, steps: int, *, single: bool = False) -> np.dtype[Any]:
    """Return the layout of the structure in `plant.h.in`, each member as plain numbers."""
    real, count = np.float32 if single else np.float64, len(CHANNELS)
    members = [
        ("parameters", real, (length(kernel.parameters),)),
        ("sensors", real, (count, length(kernel.channel))),
        ("inputs", real, (length(kernel.inputs),)),
        ("signals", real, (length(kernel.signals),)),
        ("reading", real, (count,)),
        ("states", real, (2, length(kernel.state))),
        ("overrange", np.int32, (count,)),
        ("past", real, (length(kernel.past),)),
        ("memory", real, (count, length(kernel.memory))),
        ("channel_past", real, (count, length(kernel.channel_past))),
        ("path", real, (steps, count)),
        ("random", np.uint64),
    ]
    return np.dtype(members, align=True)


class CompiledPlant:
    """A plant with its sensors, in C.

    Args:
        actuator: actuator to compile.
        kernel: kernel with at least the actuator's effects; defines the memory layout.
        single: whether to compute with float instead of double.

    Attributes:
        memory: members of the structure by name, see `memory_layout`.

    Raises:
        CompilerError: if this machine has no C compiler.
        TranslationError: if an effect's law cannot be translated to C.

    """

    def __init__(self, actuator: Exported, kernel: Kernel, *, single: bool = False) -> None:
        target = host()
        if target is None:
            raise CompilerError("a library cannot be made for this system")
        with tempfile.TemporaryDirectory() as folder:
            files = write_sources(actuator, Path(folder), single=single)
            library = Path(folder) / f"plant{target.suffix}"
            build_library(files, library, target)
            self._library = ctypes.CDLL(str(library))
        layout = memory_layout(kernel, actuator.steps, single=single)
        self.memory = np.zeros(1, layout)
        self._address = self.memory.ctypes.data_as(ctypes.c_void_p)
        self._tick = getattr(self._library, f"{actuator.name}_tick")
        self._tick.restype = ctypes.c_bool
        self._start = getattr(self._library, f"{actuator.name}_start")
        getattr(self._library, f"{actuator.name}_configure")(self._address)

    def start(self) -> None:
        """Set the plant at rest at the configured position."""
        self._start(self._address)

    def tick(self) -> bool:
        """Integrate over one tick; return whether the state is finite."""
        return bool(self._tick(self._address))


def write_sources(actuator: Exported, folder: Path, *, single: bool = False) -> list[Path]:
    """Write header and source file; return the files to compile."""
    header, body = sources(actuator, single=single)
    (folder / f"{actuator.name}.h").write_text(header, encoding="utf-8")
    (folder / f"{actuator.name}.c").write_text(body, encoding="utf-8")
    return [folder / f"{actuator.name}.c"]
