"""Parallel scenarios: on the cores of this machine, or on a Dask cluster."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from hil_emulator.errors import UserError
from hil_emulator.platform.cluster import connected
from hil_emulator.platform.output_files import refuse_existing
from hil_emulator.scenario.loading import runs_of
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.perform import perform, recordings_of
from hil_emulator.scenario.schema import Role


def run_all(
    files: Sequence[Path], workers: int = 1, cluster: str = "", recordings: Path | None = None, *,
    role: Role | None = None, overwrite: bool = False,
) -> list[Outcome]:  # fmt: skip
    """Run scenarios, each as often as it asks for; return the outcomes in the order of the files.

    Args:
        files: scenario files.
        workers: processes on this machine; 1 runs them in this one.
        cluster: address of a Dask scheduler, such as "tcp://127.0.0.1:8786", which replaces them.
        recordings: folder for recordings; see `perform`.
        role: which controller acts, in place of that of each file.
        overwrite: whether recordings that exist are replaced.

    Raises:
        UserError: if the cluster cannot be reached, or recordings exist.

    """
    runs = [(file.resolve(), number) for file in files for number in range(_count(file))]
    play = partial(_play, role=role, overwrite=overwrite)
    if recordings is not None:
        made = [made for file, run in runs for made in recordings_of(file, recordings, run)]
        refuse_existing(made, overwrite=overwrite)
        play = partial(play, recordings=recordings.resolve())
    if cluster:
        return _on_cluster(play, runs, cluster)
    if workers == 1 or len(runs) == 1:
        return [play(run) for run in runs]
    # a forked process would share the compiler's locks and the terminal's state
    with ProcessPoolExecutor(min(workers, len(runs)), get_context("spawn")) as pool:
        return _on(pool, play, runs)


Run = tuple[Path, int]
Play = Callable[[Run], Outcome]


def _count(file: Path) -> int:
    """Return the number of runs of a file; 1, which reports the mistake, if it has one."""
    try:
        return len(runs_of(file))
    except UserError:
        return 1


def _play(
    run: Run, *, role: Role | None, recordings: Path | None = None, overwrite: bool
) -> Outcome:
    file, number = run
    return perform(file, recordings, run=number, role=role, overwrite=overwrite)


def _on(executor: Executor, play: Play, runs: Sequence[Run]) -> list[Outcome]:
    return list(executor.map(play, runs))


def _on_cluster(play: Play, runs: Sequence[Run], address: str) -> list[Outcome]:
    with connected(address) as client:
        return _on(client.get_executor(pure=False), play, runs)
