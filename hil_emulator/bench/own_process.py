"""Run time and peak memory of a command of this program, run as a separate process."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from hil_emulator.errors import UserError


def time_and_memory(
    arguments: Sequence[str], environment: Mapping[str, str] | None = None,
    profile: Path | None = None,
) -> tuple[float, float]:  # fmt: skip
    """Run a command of this program; return run time [s] and peak memory [MB].

    Args:
        arguments: arguments of the command line.
        environment: additional environment variables.
        profile: file for the output of Python's profiler.

    Raises:
        UserError: if the command fails, with the command's last message.

    """
    watched = [] if profile is None else ["-m", "cProfile", "-o", str(profile)]
    begin = time.perf_counter()
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(
            [sys.executable, *watched, "-m", "hil_emulator", *arguments],
            stdout=subprocess.DEVNULL, stderr=errors, env={**os.environ, **(environment or {})},
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        if process.returncode:
            message = errors.read().strip().rpartition("\n")[2].removeprefix("hil-emulator: ")
            raise UserError(f"{arguments[0]}: {message}")
    return time.perf_counter() - begin, usage.ru_maxrss / 1024.0
