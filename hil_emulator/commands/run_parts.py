"""The parts of a machine that share nothing, each run in a process of its own."""

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
"""What a worker waits for once its part is assembled: all begin together."""


def run_parts(parts: Sequence[MachineSettings], order: MachineRun) -> None:
    """Run the parts of a machine, whose models are compiled, until all have ended.

    Where one ends with an error, the others are stopped.

    Raises:
        UserError: the first of the errors that parts have ended with.

    """
    foreman = Foreman(parts, order)
    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, lambda *_: foreman.stop())
    foreman.watch()
    foreman.conclude()


class Foreman:
    """Watches the processes, and tells the terminal what they tell.

    Args:
        parts: of the machine.
        order: how they are run.

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
        """Take what the processes tell until all have ended."""
        while self._open:
            for line in wait(self._open):
                assert isinstance(line, Connection)
                self._hear(line, self._open[line])
        self._terminal.end()

    def stop(self) -> None:
        """Ask every process to end, once: the second time would disturb its end."""
        if not self._stopped:
            self._stopped = True
            for worker in self._workers:
                worker.stop()

    def conclude(self) -> None:
        """Print how each part went; raise the first error that ended the run, or all others."""
        for worker in self._workers:
            worker.join()
        self._print(self._said)
        for error in self._errors:
            if type(error) is not HelperFailedError:
                raise error
        if self._errors:
            raise HelperFailedError("\n".join(map(str, self._errors)))

    def _hear(self, line: Connection, i: int) -> None:
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
                if type(error) is HelperFailedError:  # at the end of a part that went on
                    self._errors.append(error)
                elif error:
                    self._fail(error)

    def _assembled(self, i: int, banner: str) -> None:
        self._banners[i] = banner
        if all(self._banners):
            self._print(self._banners)
            click.echo("Ctrl-C ends.")
            for worker in self._workers:
                with suppress(OSError):  # one that has gone is missed when it is heard
                    worker.line.send(GO)

    def _print(self, texts: Sequence[str]) -> None:
        for names, text in zip(self._names, texts, strict=True):
            if text:
                click.echo(f"process   {names}\n{text}", nl=False)

    def _fail(self, error: UserError) -> None:
        self._errors.append(error)
        self.stop()


class Messenger:
    """Tells who watches over a worker what a terminal would be told."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self.live = sys.stderr.isatty()

    def ready(self) -> None:
        """Tell that the first frame is out."""
        self._line.send(("ready", None))

    def show(self, status: str) -> None:
        """Show how it stands."""
        self._line.send(("status", status))

    def warn(self, text: str) -> None:
        """Warn of something."""
        self._line.send(("warning", text))

    def end(self) -> None:
        """Let the part end in its own time: what stops it now would disturb its end."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _work(part: MachineSettings, order: MachineRun, line: Connection) -> None:
    """Run a part; what it prints goes along the line, before it begins and at its end."""
    said = io.StringIO()

    def begin() -> None:
        line.send(("assembled", said.getvalue()))
        said.seek(0)
        said.truncate()
        line.recv()

    error: UserError | None = None
    with redirect_stdout(said):
        try:
            run_part(part, order, Messenger(line), begin)
        except HelperFailedError as raised:
            error = raised
        except UserError as raised:
            error = UserError(str(raised))
            error.exit_code = raised.exit_code
    line.send(("over", (said.getvalue(), error)))
