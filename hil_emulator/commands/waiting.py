"""What takes longer than a moment says what it is, and for how long it has been at it."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

COMPILING, USUALLY = "compiling the model", "once on this machine, 10 to 60 s"

SILENT = 2.0
"""What is over within this time need not be told [s]."""

_EVERY = {True: 1.0, False: 10.0}
"""Time between two words [s]: on a terminal, which is rewritten, and elsewhere."""


@contextmanager
def waiting(what: str, usual: str) -> Iterator[None]:
    """Say what is being waited for, once it has taken over `SILENT`.

    Args:
        what: it is, such as "compiling the model".
        usual: how long it usually takes, in words.

    """
    over = threading.Event()
    teller = threading.Thread(target=_tell, args=(what, usual, over), daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()


def _tell(what: str, usual: str, over: threading.Event) -> None:
    begin, live = time.monotonic(), sys.stderr.isatty()
    pause, told = SILENT, False
    while not over.wait(pause):
        passed = time.monotonic() - begin
        start, end = ("\r\x1b[K", "") if live else ("", "\n")
        sys.stderr.write(f"{start}{what} ({usual}): {passed:.0f} s{end}")
        sys.stderr.flush()
        pause, told = _EVERY[live], True
    if told and live:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
