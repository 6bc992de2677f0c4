"""A command of this program as a process of its own: how long it takes, and how much memory."""

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
    """Run a command of this program; return time [s] and most memory [MB].

    Args:
        arguments: of the command line.
        environment: variables besides those of this process.
        profile: file for what Python's profiler sees of it.

    Raises:
        UserError: what the command said when it failed.

    """
    watched = [] if profile is None else ["-m", "cProfile", "-o", str(profile)]
    begin = time.perf_counter()
    with tempfile.TemporaryFile("w+") as told:
        process = subprocess.Popen(
            [sys.executable, *watched, "-m", "hil_emulator", *arguments],
            stdout=subprocess.DEVNULL, stderr=told, env={**os.environ, **(environment or {})},
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        told.seek(0)
        if process.returncode:
            said = told.read().strip().rpartition("\n")[2].removeprefix("hil-emulator: ")
            raise UserError(f"{arguments[0]}: {said}")
    return time.perf_counter() - begin, usage.ru_maxrss / 1024.0
