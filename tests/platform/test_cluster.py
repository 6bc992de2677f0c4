"""A Dask cluster that is there, that is not, and that goes away."""

import os
import sys
import time
from collections.abc import Iterator

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform import cluster
from hil_emulator.platform.cluster import connected, gathered

distributed = pytest.importorskip("distributed")


@pytest.fixture
def workers() -> Iterator[object]:
    """Yield a cluster with one worker process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as local:
        yield local


def slow(number: int) -> int:
    """Return the same a little later."""
    time.sleep(0.2)
    return number


def end(_: int) -> None:
    """Kill the worker."""
    os._exit(1)


def test_nobody_at_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the address, the reason and the way out."""
    monkeypatch.setattr(cluster, "CONNECTING", 0.3)
    with (
        pytest.raises(UserError, match=r"tcp://127.0.0.1:1: cannot be reached.*leave --cluster"),
        connected("tcp://127.0.0.1:1"),
    ):
        pass


def test_distributed_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra to install."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"hil-emulator\[dask\]"), connected("tcp://127.0.0.1:1"):
        pass


def test_a_scheduler_without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not waited for without an end."""
    monkeypatch.setattr(cluster, "CONNECTING", 1.0)
    with (
        distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as local,
        pytest.raises(UserError, match="no workers; start one with `dask worker"),
        connected(local.scheduler_address),
    ):
        pass


def test_the_client_is_closed_after_an_interruption(workers: object) -> None:
    """Ctrl-C leaves no connection behind."""
    with pytest.raises(KeyboardInterrupt), connected(workers.scheduler_address) as client:  # type: ignore[attr-defined]
        raise KeyboardInterrupt
    assert client.status == "closed"


def test_no_worker_is_left(workers: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """When all workers are gone for good, the wait ends with a message."""
    monkeypatch.setattr(cluster, "ASKING", 0.2)
    monkeypatch.setattr(cluster, "RESTARTING", 0.5)
    with connected(workers.scheduler_address) as client:  # type: ignore[attr-defined]
        futures = client.map(slow, range(50))
        workers.scale(0)  # type: ignore[attr-defined]
        with pytest.raises(UserError, match="no worker is left"):
            gathered(client, futures)


def test_a_task_that_kills_workers(workers: object) -> None:
    """A task of which workers die again and again is given up with a message."""
    with connected(workers.scheduler_address) as client:  # type: ignore[attr-defined]
        futures = client.map(end, [0])
        with pytest.raises(UserError, match="workers die of one task"):
            gathered(client, futures)
