"""Helper processes of a run: how they are started, watched without waiting, and closed.

A helper process writes each failure that it survives as a line on its standard output, in words for
the user (`report`). Its standard input is a pipe from the process that started it.
"""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence

from hil_emulator.errors import UserError

_CHUNK = 1 << 16  # bytes


class HelperFailedError(UserError):
    """A helper process of the run has failed; the run itself has not."""

    exit_code = 3


class RequiredHelperFailedError(HelperFailedError):
    """A helper process without which the run does not go on has failed, and ended it."""


class HelperProcess:
    """A helper process, from its start to its end.

    It has a session of its own: Ctrl-C in the terminal does not reach it.

    Args:
        command: program and arguments.
        name: begins the message if the process ends by itself, such as "panel".
        loss: ends that message: what is lost, and the way out.
        pass_fds: descriptors that the process inherits.

    Attributes:
        name: as given.
        failures: all failures so far, in words; `look` and `close` add to them.
        input: descriptor of its standard input.

    """

    def __init__(
        self, command: Sequence[str], name: str, loss: str, pass_fds: Sequence[int] = ()
    ) -> None:
        self.name = name
        self.failures: list[str] = []
        self._loss = loss
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            pass_fds=pass_fds,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        self.input = self._stdin.fileno()
        os.set_blocking(self._stdout.fileno(), False)
        self._unfinished = b""
        self._ended = False
        self._returned = 0  # failures that `look` has returned

    @property
    def pid(self) -> int:
        """Process identifier."""
        return self._process.pid

    def first_line(self) -> str | None:
        """Wait for the first line of its output; return None if it ended without a line."""
        os.set_blocking(self._stdout.fileno(), True)
        line = self._stdout.readline()
        os.set_blocking(self._stdout.fileno(), False)
        return line.decode(errors="replace").rstrip("\n") if line else None

    def write(self, data: bytes) -> None:
        """Write to its standard input, waiting for room; do nothing if the process has ended."""
        with contextlib.suppress(BrokenPipeError):
            while data:
                data = data[os.write(self.input, data) :]

    def look(self) -> list[str]:
        """Return the failures since the last look; never wait."""
        if not self._ended:
            code = self._process.poll()  # before reading: its last lines are in the pipe then
            self.failures += self._lines()
            if code is not None:
                self._end(code)
        begin, self._returned = self._returned, len(self.failures)
        return self.failures[begin:]

    def close(self) -> None:
        """Close its input and wait for its end; harmless when repeated."""
        self._stdin.close()
        if not self._ended:
            os.set_blocking(self._stdout.fileno(), True)
            self.failures += self._lines()
            code = self._process.wait()
            if code and not self.failures:
                self._end(code)
            self._ended = True
        self._stdout.close()

    def _end(self, code: int) -> None:
        """Add the failure that the process has ended by itself."""
        self._ended = True
        self.failures.append(f"{self.name}: its process {ending(code)}; {self._loss}")

    def _lines(self) -> list[str]:
        """Return the complete lines that can be read now; all up to the end if reading blocks."""
        while part := self._stdout.read(_CHUNK):
            self._unfinished += part
        *lines, self._unfinished = self._unfinished.split(b"\n")
        return [line.decode(errors="replace") for line in lines]


def ending(code: int) -> str:
    """Return in words how a process ended.

    Args:
        code: as `subprocess.Popen.returncode`, negative for a signal.

    """
    if code >= 0:
        return f"ended by itself with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"was ended by signal {-code}"
    return f"was ended by signal {-code} ({name})"


def report(failure: str) -> None:
    """Report a failure of this process, a helper, to the process that started it."""
    with contextlib.suppress(OSError):
        os.write(sys.stdout.fileno(), f"{failure}\n".encode())
