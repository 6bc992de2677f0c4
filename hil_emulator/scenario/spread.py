"""Parallel scenarios: on the cores of this machine, or on a Dask cluster."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from hil_emulator.platform.cluster import connected
from hil_emulator.platform.output_files import refuse_existing
from hil_emulator.scenario.outcome import Outcome
from hil_emulator.scenario.perform import perform, recordings_of


def run_all(
    files: Sequence[Path], workers: int = 1, cluster: str = "", recordings: Path | None = None, *,
    overwrite: bool = False,
) -> list[Outcome]:  # fmt: skip
    """Run scenarios and return their outcomes in the order of the files.

    Args:
        files: scenario files.
        workers: processes on this machine; 1 runs them in this one.
        cluster: address of a Dask scheduler, such as "tcp://127.0.0.1:8786", which replaces them.
        recordings: folder for recordings; see `perform`.
        overwrite: whether recordings that exist are replaced.

    Raises:
        UserError: if the cluster cannot be reached, or recordings exist.

    """
    paths = [file.resolve() for file in files]
    play = partial(perform, overwrite=overwrite)
    if recordings is not None:
        made = [made for file in files for made in recordings_of(file, recordings)]
        refuse_existing(made, overwrite=overwrite)
        play = partial(play, recordings=recordings.resolve())
    if cluster:
        return _on_cluster(play, paths, cluster)
    if workers == 1 or len(files) == 1:
        return [play(path) for path in paths]
    # a forked process would share the compiler's locks and the terminal's state
    with ProcessPoolExecutor(min(workers, len(files)), get_context("spawn")) as pool:
        return _on(pool, play, paths)


Play = Callable[[Path], Outcome]


def _on(executor: Executor, play: Play, paths: Sequence[Path]) -> list[Outcome]:
    return list(executor.map(play, paths))


def _on_cluster(play: Play, paths: Sequence[Path], address: str) -> list[Outcome]:
    with connected(address) as client:
        return _on(client.get_executor(pure=False), play, paths)
