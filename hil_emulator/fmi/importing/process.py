"""Steps an FMU in the process of `worker`, so that a crash of the FMU does not end the run."""

import json
import os
import select
import subprocess
import sys
import tempfile
import weakref
from pathlib import Path

import numpy as np

from hil_emulator.fmi.importing import worker
from hil_emulator.fmi.importing.wiring import Wiring

Vector = np.ndarray[tuple[int], np.dtype[np.float64]]

_STARTING = 60.0
"""Longest time that unpacking, loading and initialising may take [s] (assumed)."""


class FmuFailedError(Exception):
    """An FMU has failed, crashed or hung; the message states which."""


class FmuProcess:
    """An FMU in a separate process.

    Args:
        file: FMU file.
        wiring: wired variables.
        step: integration step of an FMU for model exchange [s].
        steps: integration steps per tick; a communication step is a tick.
        timeout: longest time of one step [s].

    Attributes:
        outputs: outputs at the present time, in the FMU's units.

    Raises:
        FmuFailedError: if the FMU cannot be started.

    """

    def __init__(self, file: Path, wiring: Wiring, step: float, steps: int, timeout: float) -> None:
        request = {
            "inputs": [w.reference for w in wiring.inputs.values()],
            "outputs": [w.reference for w in wiring.outputs.values()],
            "parameters": list(wiring.parameters.items()),
            "interface": wiring.interface,
            "step": step,
            "steps": steps,
        }
        # unpacked here, since a killed process does not remove its files
        folder = tempfile.TemporaryDirectory()
        words = [sys.executable, "-m", worker.__name__, str(file.resolve()), folder.name]
        self._process = subprocess.Popen(
            [*words, json.dumps(request)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,  # Ctrl-C in the terminal reaches the emulator only
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._poll = select.poll()
        self._poll.register(self._from, select.POLLIN)
        self._end = weakref.finalize(self, _kill, self._process, folder)
        self._size = 1 + 8 * len(wiring.outputs)
        self._timeout = timeout
        self.outputs = self._answer(_STARTING)

    def step(self, inputs: Vector) -> None:
        """Take a step with the inputs held, in the FMU's units.

        Raises:
            FmuFailedError: if the FMU failed, crashed or hung; its process has ended then.

        """
        try:
            os.write(self._to, inputs.tobytes() or b"\0")
        except OSError:
            raise self._failed(self._last_words()) from None
        self.outputs = self._answer(self._timeout)

    def close(self) -> None:
        """End the process."""
        self._end()

    def _answer(self, timeout: float) -> Vector:
        if not self._poll.poll(timeout * 1e3):
            raise self._failed(f"has not answered for {timeout:g} s")
        reply = os.read(self._from, self._size + worker.MESSAGE)
        if len(reply) < self._size:
            raise self._failed(self._last_words())
        if reply[0] != worker.OK:
            raise self._failed(reply[self._size :].decode(errors="replace").strip())
        return np.frombuffer(reply, np.float64, offset=1)

    def _last_words(self) -> str:
        """Return how the process ended."""
        code = self._process.wait(timeout=5.0)
        return f"has crashed: signal {-code}" if code < 0 else f"has ended with exit code {code}"

    def _failed(self, why: str) -> FmuFailedError:
        self.close()
        return FmuFailedError(why)


def _kill(process: "subprocess.Popen[bytes]", folder: "tempfile.TemporaryDirectory[str]") -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe:
            pipe.close()
    folder.cleanup()
