"""Progress line of a long job: its name, the time so far and the time left."""

import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import click
from numba.core.event import RecordingListener, install_listener

from hil_emulator.commands.past_times import Usual, job, recall, remember

PREPARING = "preparing the model"

SILENT = 2.0
"""Duration up to which no line is shown [s]."""

_EVERY = {True: 1.0, False: 10.0}
"""Time between two lines [s]: on a terminal, where the line is rewritten, and elsewhere."""


@contextmanager
def waiting(what: str, files: Sequence[Path] = (), *, json: bool = False) -> Iterator["Progress"]:
    """Show on stderr how long a job still takes, once it has taken longer than `SILENT`.

    Args:
        what: the job, such as "characterise all".
        files: files on which the duration depends.
        json: whether a program reads the output; then the line is shown on a terminal only.

    """
    name = job(what, files)
    compilation = RecordingListener()  # type: ignore[no-untyped-call]
    progress = Progress(what, recall(name), compilation)
    silent = json and not sys.stderr.isatty()
    with install_listener("numba:compile", compilation), progress.shown(silent):
        yield progress
    if progress.passed > SILENT:
        compiling = compilation_of(compilation)[0]
        remember(name, progress.passed - compiling, compiling)


class Progress:
    """A line that is rewritten; messages are printed above it.

    Args:
        what: see `waiting`.
        usual: last duration of the job.
        compilation: notified when numba begins and ends to compile.

    """

    def __init__(self, what: str, usual: Usual, compilation: RecordingListener) -> None:
        self._what, self._usual, self._compilation = what, usual, compilation
        self._begin = time.time()  # the clock of numba's events
        self._terminal = sys.stderr.isatty()
        self._writing = threading.Lock()

    @property
    def passed(self) -> float:
        """Time since the beginning [s]."""
        return time.time() - self._begin

    def report(self, text: str) -> None:
        """Print a line above the progress line on stderr."""
        with self._writing:
            self._erase()
            click.echo(text, err=True)

    def line(self) -> str:
        """Return the job, the time so far and the time left."""
        spent, busy = compilation_of(self._compilation)
        what = f"{self._what}: compiling, once on this machine" if busy else self._what
        return f"{what}; {left(self.passed, self._usual.whole(compiled=spent > 0.0))}"

    @contextmanager
    def shown(self, silent: bool) -> Iterator[None]:
        """Show the line while the context is open."""
        over = threading.Event()
        display = threading.Thread(target=self._show_until, args=(over,), daemon=True)
        if not silent:
            display.start()
        try:
            yield
        finally:
            over.set()
            if not silent:
                display.join()

    def _show_until(self, over: threading.Event) -> None:
        pause = SILENT
        while not over.wait(pause):
            pause = _EVERY[self._terminal]
            with self._writing:
                self._erase()
                sys.stderr.write(self.line() + ("" if self._terminal else "\n"))
                sys.stderr.flush()
        self._erase()

    def _erase(self) -> None:
        if self._terminal:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def left(passed: float, usual: float | None) -> str:
    """Return the time so far and the time left [s] in words."""
    if usual is None:
        return f"{passed:.0f} s, time left unknown: first time on this machine"
    if usual <= passed:
        return f"{passed:.0f} s, longer than the {usual:.0f} s of last time"
    return f"{passed:.0f} s, some {usual - passed:.0f} s left"


def compilation_of(heard: RecordingListener) -> tuple[float, bool]:
    """Return the time that numba has compiled [s], and whether it compiles now.

    Compilations are nested: the outermost one counts.
    """
    depth, total, begin = 0, 0.0, 0.0
    for at, event in list(heard.buffer):
        if event.is_start and depth == 0:
            begin = at
        depth += 1 if event.is_start else -1
        if depth == 0:
            total += at - begin
    return (total + time.time() - begin, True) if depth else (total, False)
