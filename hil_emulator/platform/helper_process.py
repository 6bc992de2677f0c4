"""Processes that serve a run beside its loop: started, watched without waiting, ended.

Every helper process follows one rule: what goes wrong while it works it writes on its standard
output, one line each, whole sentences for the user. Its standard input is a pipe from the loop.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from hil_emulator.errors import UserError

_CHUNK = 1 << 16  # bytes
_LOOK_S = 0.25  # between two looks at the helpers (assumed)


class HelperFailedError(UserError):
    """A helper process of the run has failed; the run itself has not."""

    exit_code = 3


class HelperProcess:
    """A process that works for the loop.

    Ctrl-C in the terminal does not reach it: it ends when it is closed, or when this process does.

    Args:
        command: its words.
        name: what it is, as a failure begins: "panel".
        loss: what is lost if it ends by itself, and the way out.
        pass_fds: descriptors that it inherits.

    Attributes:
        name: as given.
        failures: what has gone wrong so far, see `look`.
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
        self._seen = 0  # of its failures

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    def first_line(self) -> str | None:
        """Wait for its first line and return it; None if it has ended without any."""
        os.set_blocking(self._stdout.fileno(), True)
        line = self._stdout.readline()
        os.set_blocking(self._stdout.fileno(), False)
        return line.decode(errors="replace").rstrip("\n") if line else None

    def write(self, data: bytes) -> None:
        """Write to its standard input, and wait until all is taken; one that has gone takes all."""
        with contextlib.suppress(BrokenPipeError):
            while data:
                data = data[os.write(self.input, data) :]

    def look(self) -> list[str]:
        """Return the failures since the last look; never wait."""
        if not self._ended:
            code = self._process.poll()  # first: what it has written until then can be read below
            self.failures += self._lines()
            if code is not None:
                self._end(code)
        seen, self._seen = self._seen, len(self.failures)
        return self.failures[seen:]

    def close(self) -> None:
        """Close its input, and wait until it has ended; `failures` is complete then."""
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
        """Take down that it has ended by itself."""
        self._ended = True
        self.failures.append(f"{self.name}: its process {ending(code)}; {self._loss}")

    def _lines(self) -> list[str]:
        """Return the whole lines that can be read; where reading waits, all up to the end."""
        while part := self._stdout.read(_CHUNK):
            self._unfinished += part
        *lines, self._unfinished = self._unfinished.split(b"\n")
        return [line.decode(errors="replace") for line in lines]


def ending(code: int) -> str:
    """Return in words how a process has ended whose exit code Python gives."""
    if code >= 0:
        return f"ended by itself with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"was ended by signal {-code}"
    return f"was ended by signal {-code} ({name})"


def report(failure: str) -> None:
    """Report a failure of this process, which is a helper, to the one that started it.

    Where that has gone, nothing happens.
    """
    with contextlib.suppress(OSError):
        os.write(sys.stdout.fileno(), f"{failure}\n".encode())


class Supervisor(AbstractContextManager["Supervisor"]):
    """Watches the helper processes of a run; failures are said as soon as they are seen.

    At the end of its context, when all helpers have been closed, it raises them.

    Args:
        say: shows the user a line.

    Attributes:
        failures: what has gone wrong so far.

    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self.failures: list[str] = []
        self._say = say
        self._helpers: list[HelperProcess] = []
        self._required: list[HelperProcess] = []
        self._due = 0.0

    def watch(self, helper: HelperProcess, *, required: bool = False) -> None:
        """Watch a helper from now on.

        Args:
            helper: which.
            required: whether `look` ends the run once it has failed.

        """
        self._helpers.append(helper)
        if required:
            self._required.append(helper)

    def look(self) -> None:
        """Look at all helpers, a few times a second however often it is called.

        Raises:
            HelperFailedError: if a required one has failed.

        """
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + _LOOK_S
        for failure in self._new():
            self._say(failure)
        if any(helper.failures for helper in self._required):
            raise HelperFailedError("the run has ended with it, as required")

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Raise what has gone wrong, unless something worse than that ends the run.

        Raises:
            HelperFailedError: if a helper has failed.

        """
        self._new()
        if self.failures and (error is None or isinstance(error, HelperFailedError)):
            last = [] if error is None else [str(error)]
            raise HelperFailedError("\n".join([*self.failures, *last])) from None

    def _new(self) -> list[str]:
        """Return the failures since the last look."""
        new = [failure for helper in self._helpers for failure in helper.look()]
        self.failures += new
        return new
