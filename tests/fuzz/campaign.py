"""A long attack on the readers of files, which can be stopped and goes on where it was.

    nice python -m tests.fuzz.campaign --cases 100000 --state FILE

FILE holds the counts. Files that caused a traceback are kept in the folder FILE.failures, together
with the traceback. The memory of the process is limited. The damage of a case depends on its number
and the seed only: `--only KIND --first N --cases 1` repeats one.
"""

import argparse
import importlib
import json
import logging
import os
import resource
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.identify.measured import formats
from hil_emulator.identify.measured.formats import own_process
from hil_emulator.identify.measured.formats.table import LogTable
from hil_emulator.input_files import GIB
from tests.fuzz.files import Study

MEMORY = 6 * GIB
"""Address space of the process [B]: libraries take 2 GiB (assumed)."""

SAVED_EVERY_S = 20.0


def in_a_fork(reader: str, file: Path, headings: Sequence[str] = ()) -> LogTable:
    """Do what `own_process.read` does in a process that has imported all there is already.

    Raises:
        UserError: as the module does, and if the process has ended.

    """
    module = importlib.import_module(f"{own_process.__package__}.{reader}")
    table = file.with_suffix(".table")
    table.unlink(missing_ok=True)
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        try:
            own_process._limit_memory(file)
            own_process._pack(module.read(file, headings), table)
            os._exit(0)
        except UserError as error:
            table.write_text(str(error))
            os._exit(2)
        except MemoryError:
            os._exit(3)
        except BaseException as error:
            table.write_text(repr(error))
            os._exit(1)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == 0:
        return own_process._unpacked(table)
    if code == 1:
        raise RuntimeError(f"in its own process: {table.read_text()}")
    raise UserError(table.read_text() if code == 2 else f"{file}: ends the process: {code}")


class Campaign:
    """A study that remembers how far it is.

    Args:
        study: the study.
        state: file of its counts.

    Attributes:
        done: cases so far.

    """

    def __init__(self, study: Study, state: Path) -> None:
        self._study, self._state = study, state
        self.done = 0
        if state.exists():
            kept = json.loads(state.read_text())
            self.done = kept["done"]
            counts = {(name, result): n for name, result, n in kept["counts"]}
            study.counts, study.slowest = Counter(counts), kept["slowest"]

    def run(self, cases: int) -> None:
        """Go on until so many cases have been put to their readers in all."""
        saved = time.monotonic()
        while self.done < cases:
            self._study.one(self.done)
            self.done += 1
            if time.monotonic() - saved > SAVED_EVERY_S:
                self.save()
                saved = time.monotonic()
        self.save()

    def save(self) -> None:
        """Write the counts, and what has failed."""
        counts = [[*key, n] for key, n in self._study.counts.items()]
        content = {"done": self.done, "counts": counts, "slowest": self._study.slowest}
        new = self._state.with_suffix(".new")
        new.write_text(json.dumps(content))
        new.replace(self._state)
        self._state.with_suffix(".txt").write_text(self._study.report() + "\n")
        folder = Path(f"{self._state}.failures")
        for key, failure in self._study.failures.items():
            folder.mkdir(exist_ok=True)
            stem = f"{failure.reader.replace(' ', '_')}_{key}"
            (folder / f"{stem}.txt").write_text(f"case {failure.case}\n{failure.trace}")
            (folder / f"{stem}.bin").write_bytes(failure.content)


def main() -> int:
    """Run the campaign; exit code 1 if anything has ended in a traceback."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.campaign")
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--state", type=Path, default=Path("campaign.json"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="one kind of file; keeps no state")
    parser.add_argument("--without", default="", help="kinds to leave out, such as nbi,nbc")
    parser.add_argument("--first", type=int, default=0, help="with --only: the first case")
    given = parser.parse_args()
    logging.disable(logging.CRITICAL)  # libraries log what they refuse
    warnings.simplefilter("ignore")
    for ending, name in ((".mat", "matlab"), (".mf4", "measurement_data")):
        read = partial(in_a_fork, name)
        formats.BY_ENDING[ending] = replace(formats.BY_ENDING[ending], read=read)
    begin = time.monotonic()
    study = Study(given.seed, frozenset(filter(None, given.without.split(","))))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    try:
        if given.only:
            for case in range(given.first, given.first + given.cases):
                study.one(case, given.only)
        else:
            Campaign(study, given.state).run(given.cases)
    finally:
        study.close()
    print(study.report())
    print(f"{time.monotonic() - begin:.0f} s")
    bad = sum(n for (_, result), n in study.counts.items() if result in ("failed", "slow"))
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
