"""Mutated files put to every reader: each is read, or refused in one message."""

import random
import shutil
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from hil_emulator.errors import brief
from tests.fuzz.mutation import mutated
from tests.fuzz.readers import READERS, Reader, attempt, seeds

CORPUS = Path(__file__).parent / "corpus"
"""Files that once ended in a traceback, in folders named like their readers."""

ENDING = {"scenario": "toml", "profile": "csv", "dcf": "eds"}


class Study:
    """Mutates files and keeps count.

    Args:
        seed: of everything random.

    Attributes:
        counts: how many were read and refused, by reader.
        failures: reader, last lines of the traceback, content.
        slowest: time of the slowest file [s], by reader.

    """

    def __init__(self, seed: int) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self.failures: list[tuple[str, str, bytes]] = []
        self.slowest: dict[str, float] = {}
        self._chance = random.Random(seed)
        self._folder = Path(tempfile.mkdtemp())
        self._seeds = seeds(self._folder)

    def run(self, count: int, only: str = "") -> None:
        """Put so many files to the readers, by their shares."""
        chosen = [r for r in READERS if only in ("", r.name)]
        for reader in self._chance.choices(chosen, [r.share for r in chosen], k=count):
            self._one(reader)

    def close(self) -> None:
        """Remove the files."""
        shutil.rmtree(self._folder)

    def _one(self, reader: Reader) -> None:
        content = mutated(self._chance, self._chance.choice(self._seeds[reader.name]))
        file = self._folder / f"mutant.{ENDING.get(reader.name, reader.name)}"
        file.write_bytes(content)
        begin = time.process_time()
        try:
            result = "read" if attempt(reader, file) else "refused"
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            result = "failed"
            told = "".join(traceback.format_exception(error)[-3:])
            self.failures.append((reader.name, told, content))
        self.counts[reader.name, result] += 1
        taken = time.process_time() - begin
        self.slowest[reader.name] = max(taken, self.slowest.get(reader.name, 0.0))

    def report(self) -> str:
        """Return the counts as a table, then each kind of failure once."""
        lines = [f"{'reader':10} {'read':>8} {'refused':>8} {'failed':>8}  slowest [s]"]
        for reader in READERS:
            cells = [self.counts[reader.name, r] for r in ("read", "refused", "failed")]
            slowest = self.slowest.get(reader.name, 0.0)
            lines.append(f"{reader.name:10} {cells[0]:8} {cells[1]:8} {cells[2]:8}  {slowest:.3f}")
        seen = set()
        for name, told, content in self.failures:
            key = name, told.strip().splitlines()[-2:][0], told.strip().splitlines()[-1][:40]
            if key not in seen:
                seen.add(key)
                lines += [f"--- {name}: {brief(content)}", told]
        return "\n".join(lines)
