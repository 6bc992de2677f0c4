"""Main program of the process in which an FMU runs, separate from the process of the bus.

    python -m hil_emulator.fmi.importing.worker FILE FOLDER REQUEST

FILE is unpacked into FOLDER. REQUEST is JSON: interface, value references of inputs and outputs,
parameters, integration step, steps per tick. On standard input come the values of the inputs,
packed; on standard output go a status and the values of the outputs, one answer before the first
step with the start values. The process ends at the end of its input.
"""

import ctypes
import json
import os
import sys
from typing import Any

from hil_emulator.fmi.importing.instance import MODEL_EXCHANGE, Instance

OK, FAILED = 0, 1
MESSAGE = 400
"""Length of the message at the end of each answer [B]."""


def main(file: str, folder: str, request: dict[str, Any]) -> None:
    """Answer requests until the input ends."""
    # output that the FMU prints must not mix with the answers
    answers = os.dup(1)
    os.dup2(2, 1)
    nothing = bytes(8 * len(request["outputs"]))
    try:
        fmu = _instance(file, request, folder)
        os.write(answers, bytes([OK]) + bytes(fmu.outputs))
        while True:
            given = os.read(0, max(1, ctypes.sizeof(fmu.inputs)))
            if not given:
                return
            ctypes.memmove(fmu.inputs, given, ctypes.sizeof(fmu.inputs))
            fmu.tick()
            os.write(answers, bytes([OK]) + bytes(fmu.outputs))
    except Exception as error:  # the other process reports every error
        message = str(error).encode()[:MESSAGE].ljust(MESSAGE)
        os.write(answers, bytes([FAILED]) + nothing + message)


def _instance(file: str, request: dict[str, Any], folder: str) -> Instance:
    # only model exchange needs compiled code
    if request["interface"] == MODEL_EXCHANGE:
        from hil_emulator.fmi.importing.model_exchange import ModelExchange

        return ModelExchange(file, request, folder)
    from hil_emulator.fmi.importing.co_simulation import CoSimulation

    return CoSimulation(file, request, folder)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], json.loads(sys.argv[3]))
