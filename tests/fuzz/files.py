"""Mutated files put to every reader: each is read, or refused in one message."""

import hashlib
import random
import shutil
import signal
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.mutation import mutated
from tests.fuzz.readers import READERS, SHEET, Reader, attempt
from tests.fuzz.seeds import CONFIGS, seeds

CORPUS = Path(__file__).parent / "corpus"
"""Files that once ended in a traceback, in folders named like their readers."""

LONGEST_S = 30.0
"""Time that a file may take [s] (assumed)."""

RESULTS = ("read", "refused", "failed", "slow")


@dataclass(frozen=True)
class Failure:
    """A file that ended in something else than a message.

    Attributes:
        reader: its name.
        case: number of the file.
        trace: the traceback.
        content: of the file.

    """

    reader: str
    case: int
    trace: str
    content: bytes

    @property
    def key(self) -> str:
        """What failures of one cause have in common: where it was raised, and what."""
        lines = [line.strip() for line in self.trace.strip().splitlines()]
        places = [line for line in lines if line.startswith("File ")]
        kind = lines[-1].partition(":")[0]
        return hashlib.sha256(f"{self.reader}{places[-1:]}{kind}".encode()).hexdigest()[:12]


class Study:
    """Mutates files and keeps count.

    Args:
        seed: of everything random.
        without: readers that are left out.

    Attributes:
        counts: how many were read and refused, by reader.
        failures: by cause, the first of each.
        slowest: processor time of the slowest file [s] and its number, by reader.

    """

    def __init__(self, seed: int, without: frozenset[str] = frozenset()) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self.failures: dict[str, Failure] = {}
        self.slowest: dict[str, list[float]] = {}
        self._readers = [r for r in READERS if r.name not in without]
        self._seed = seed
        self._root = Path(tempfile.mkdtemp())
        self._folder = self._root / CONFIGS.name
        for folder in (CONFIGS, SHEET.parent):  # configurations name files of the same folder
            shutil.copytree(folder, self._root / folder.name)
        self._seeds = seeds(self._folder, [r.name for r in self._readers])

    def close(self) -> None:
        """Remove the files."""
        shutil.rmtree(self._root)

    def sound(self) -> None:
        """Put the sound files to their readers."""
        for reader in self._readers:
            for content in self._seeds[reader.name]:
                self._counted(reader, -1, content)

    def one(self, case: int, only: str = "") -> None:
        """Put a file to its reader; which, and how it is damaged, follows from its number."""
        chance = random.Random(f"{self._seed} {case}")
        chosen = [r for r in self._readers if only in ("", r.name)]
        (reader,) = chance.choices(chosen, [r.share for r in chosen])
        self._counted(reader, case, mutated(chance, chance.choice(self._seeds[reader.name])))

    def _counted(self, reader: Reader, case: int, content: bytes) -> None:
        begin = time.process_time()
        self.counts[reader.name, self._put(reader, case, content)] += 1
        taken = time.process_time() - begin
        self.slowest[reader.name] = max([taken, case], self.slowest.get(reader.name, [0.0, 0]))

    def _put(self, reader: Reader, case: int, content: bytes) -> str:
        file = self._folder / f"mutant.{reader.ending or reader.name}"
        file.write_bytes(content)
        try:
            with _limited_time():
                return "read" if attempt(reader, file) else "refused"
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            trace = "".join(traceback.format_exception(error))
            failure = Failure(reader.name, case, trace, content)
            self.failures.setdefault(failure.key, failure)
            return "slow" if isinstance(error, _TooSlowError) else "failed"

    def report(self) -> str:
        """Return the counts as a table, then each kind of failure once."""
        cells = "".join(f"{result:>9}" for result in RESULTS)
        lines = [f"{'kind':17}{'cases':>9}{cells}  slowest [s], case"]
        names = [reader.name for reader in self._readers]
        for name in names:
            row = [self.counts[name, result] for result in RESULTS]
            taken, case = self.slowest.get(name, [0.0, 0])
            lines.append(_line(name, row) + f"  {taken:.2f} {case:.0f}")
        lines.append(_line("all", [sum(self.counts[n, r] for n in names) for r in RESULTS]))
        for failure in self.failures.values():
            last = "\n".join(failure.trace.strip().splitlines()[-3:])
            lines.append(f"--- {failure.reader}, case {failure.case}, {failure.key}:\n{last}")
        return "\n".join(lines)


class _TooSlowError(BaseException):
    """A file has taken longer than it may; no reader catches it."""


@contextmanager
def _limited_time() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise _TooSlowError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _line(name: str, row: list[int]) -> str:
    return f"{name:17}{sum(row):9}" + "".join(f"{count:9}" for count in row)
