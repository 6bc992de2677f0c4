"""Independent parts of a machine, each run in a process of its own."""

import io
import signal
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress
from functools import partial
from multiprocessing.connection import Connection, wait

import click

from hil_emulator.commands.live import Terminal
from hil_emulator.commands.run_part import MachineRun, run_part
from hil_emulator.config.machine import MachineSettings
from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import HelperFailedError
from hil_emulator.platform.worker import Worker

GO = "go"
"""Message for which an assembled worker waits, so that all begin together."""


def run_parts(parts: Sequence[MachineSettings], order: MachineRun) -> None:
    """Run the parts of a machine, whose models are compiled, until all have ended.

    If one ends with an error, the others are stopped.

    Raises:
        UserError: the first of the parts' errors.

    """
    foreman = WorkerGroup(parts, order)
    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, lambda *_: foreman.stop())
    foreman.watch()
    foreman.conclude()


class WorkerGroup:
    """Watches the processes, and prints their messages.

    Args:
        parts: of the machine.
        order: options of the run.

    """

    def __init__(self, parts: Sequence[MachineSettings], order: MachineRun) -> None:
        self._names = [", ".join(a.name for a in part.actuators) for part in parts]
        self._workers = [Worker(partial(_work, part, order)) for part in parts]
        self._open = {worker.line: i for i, worker in enumerate(self._workers)}
        self._terminal = Terminal()
        self._banners = [""] * len(parts)
        self._said = [""] * len(parts)
        self._ready = 0
        self._status = [""] * len(parts)
        self._errors: list[UserError] = []
        self._stopped = False

    def watch(self) -> None:
        """Handle the processes' messages until all have ended."""
        while self._open:
            for line in wait(self._open):
                assert isinstance(line, Connection)
                self._handle(line, self._open[line])
        self._terminal.end()

    def stop(self) -> None:
        """Request the end of every process, once: a second request would disturb the end."""
        if not self._stopped:
            self._stopped = True
            for worker in self._workers:
                worker.stop()

    def conclude(self) -> None:
        """Print each part's summary; raise the first error that ended the run, or all others."""
        for worker in self._workers:
            worker.join()
        self._print(self._said)
        for error in self._errors:
            if type(error) is not HelperFailedError:
                raise error
        if self._errors:
            raise HelperFailedError("\n".join(map(str, self._errors)))

    def _handle(self, line: Connection, i: int) -> None:
        try:
            kind, content = line.recv()
        except (EOFError, OSError):
            del self._open[line]
            if not self._stopped:
                self._fail(self._workers[i].failure(f"the process of {self._names[i]}"))
            return
        match kind:
            case "assembled":
                self._assembled(i, content)
            case "ready":
                self._ready += 1
                if self._ready == len(self._workers):
                    self._terminal.ready()
            case "status":
                self._status[i] = content
                self._terminal.show(" | ".join(filter(None, self._status)))
            case "warning":
                self._terminal.warn(f"{content} ({self._names[i]})")
            case "over":
                del self._open[line]
                self._said[i], error = content
                if type(error) is HelperFailedError:  # at the end of a part that continued
                    self._errors.append(error)
                elif error:
                    self._fail(error)

    def _assembled(self, i: int, banner: str) -> None:
        self._banners[i] = banner
        if all(self._banners):
            self._print(self._banners)
            click.echo("Ctrl-C ends.")
            for worker in self._workers:
                with suppress(
                    OSError
                ):  # a process that has ended is noticed when its message is read
                    worker.line.send(GO)

    def _print(self, texts: Sequence[str]) -> None:
        for names, text in zip(self._names, texts, strict=True):
            if text:
                click.echo(f"process   {names}\n{text}", nl=False)

    def _fail(self, error: UserError) -> None:
        self._errors.append(error)
        self.stop()


class StatusForwarder:
    """Forwards a worker's status lines to its supervisor."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self.live = sys.stderr.isatty()

    def ready(self) -> None:
        """Report that the first frame has been sent."""
        self._line.send(("ready", None))

    def show(self, status: str) -> None:
        """Forward the status."""
        self._line.send(("status", status))

    def warn(self, text: str) -> None:
        """Forward a warning."""
        self._line.send(("warning", text))

    def end(self) -> None:
        """Ignore signals from now on: they would disturb the end of the part."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _work(part: MachineSettings, order: MachineRun, line: Connection) -> None:
    """Run a part; its output is sent along the line, before the first tick and at the end."""
    output = io.StringIO()

    def begin() -> None:
        line.send(("assembled", output.getvalue()))
        output.seek(0)
        output.truncate()
        line.recv()

    error: UserError | None = None
    with redirect_stdout(output):
        try:
            run_part(part, order, StatusForwarder(line), begin)
        except HelperFailedError as raised:
            error = raised
        except UserError as raised:
            error = UserError(str(raised))
            error.exit_code = raised.exit_code
    line.send(("over", (output.getvalue(), error)))
