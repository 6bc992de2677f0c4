"""Connection to a Dask cluster, and waiting for its results."""

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from pkgutil import get_data
from typing import Any

from hil_emulator.errors import UserError

CONNECTING = 5.0
"""Time within which a scheduler must answer and have a worker [s] (assumed)."""

ASKING = 2.0
"""Period at which the number of workers is checked during a wait for results [s] (assumed)."""

RESTARTING = 15.0
"""Time within which a cluster without workers must get one [s] (assumed: nannies take seconds)."""

WITNESS = ("hil_emulator", "platform/cluster.py")
"""Package and file that a worker must have."""

INSTEAD = "or leave --cluster out to compute on this machine"


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Yield a `distributed.Client` of a scheduler; the client is closed at the end.

    Args:
        address: address of the scheduler, such as "tcp://127.0.0.1:8786".

    Raises:
        UserError: if distributed is not installed, no scheduler answers, the scheduler has no
            worker, or a worker lacks this package.

    """
    client = _client(address)
    try:
        _prepared(client, address)
        yield client
    finally:
        client.close()


def gathered(client: Any, futures: Sequence[Any]) -> list[Any]:
    """Return the results of futures in order; Dask repeats the tasks of a lost worker.

    Raises:
        UserError: if the scheduler is lost, no worker is left, or a task repeatedly kills workers.

    """
    from distributed import KilledWorker

    address = client.scheduler.address
    try:
        _wait(client, futures, address)
        return list(client.gather(futures))
    except KilledWorker as error:
        cause = str(error).partition(". ")[0]
        reason = f"workers die of one task, perhaps for want of memory: {cause}"
    except CancelledError:
        reason = "the connection to the scheduler was lost"
    except OSError as error:
        reason = f"the connection to the scheduler was lost: {error}"
    raise UserError(f"--cluster {address}: {reason}; mend the cluster, {INSTEAD}")


def _wait(client: Any, futures: Sequence[Any], address: str) -> None:
    """Wait for results as long as there are workers."""
    from distributed import wait

    while True:
        try:
            wait(futures, timeout=ASKING)  # type: ignore[no-untyped-call]
            return
        except TimeoutError:
            if client.nthreads():
                continue
        try:
            client.wait_for_workers(1, timeout=RESTARTING)
        except TimeoutError:
            raise UserError(
                f"--cluster {address}: no worker is left, and no worker came back within "
                f"{RESTARTING:g} s; start one with `dask worker {address}`, {INSTEAD}"
            ) from None


def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise UserError(
            f"--cluster {address} needs distributed, which is not installed; "
            f"pip install 'hil-emulator[dask]', {INSTEAD}"
        ) from None
    try:
        return Client(address, timeout=CONNECTING)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise UserError(
            f"--cluster {address}: cannot be reached: {error}; start a scheduler there with "
            f"`dask scheduler`, {INSTEAD}"
        ) from None


def _prepared(client: Any, address: str) -> None:
    """Raise if there are no workers, or if one cannot import this package."""
    try:
        client.wait_for_workers(1, timeout=CONNECTING)
    except TimeoutError:
        raise UserError(
            f"--cluster {address}: the scheduler has no workers; start one with "
            f"`dask worker {address}`, {INSTEAD}"
        ) from None
    # a function of Python's standard library, which every worker has
    contents = client.run(get_data, *WITNESS, on_error="return")
    lacking = [worker for worker, content in contents.items() if not isinstance(content, bytes)]
    try:
        client.run_on_scheduler(get_data, *WITNESS)
    except (ImportError, OSError):
        lacking.append("the scheduler")
    if lacking:
        raise UserError(
            f"--cluster {address}: {', '.join(lacking)}: no hil-emulator there, or an older one; "
            f"install the same version there as here, {INSTEAD}"
        )
