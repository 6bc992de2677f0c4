"""An identification on the workers of a Dask cluster is the one of this process."""

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.config.effect_files import effect_files, read_effects, restored
from hil_emulator.identify.prediction.benches.force_balance import StaticObserver
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.parallel.cluster_pool import ClusterPool
from hil_emulator.identify.prediction.parallel.pool import Point, Threads
from hil_emulator.identify.session import Question, identify
from hil_emulator.platform import cluster
from hil_emulator.platform.cluster import connected
from tests.identify.rig_data import CACHE, INSTRUMENTS, campaign, knee, knee_model, recorded

RIG = Path(__file__).parent / "data" / "friction_rig.toml"
LOG = RIG.parent / "oring_1bar.csv"
OWN = '''"""An effect of the user."""
from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import friction

@effect(
    stage=friction, knob=Param("excess", "N", "force", typical=1.0, low=0.0, high=9.0),
    source="assumed", signature="nothing",
)
def dry_drag(velocity, excess):
    """F = F_x sgn(v)."""
    return excess if velocity > 0.0 else -excess

EFFECTS = (dry_drag,)
'''


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Yield the address of a cluster of two processes."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(CACHE))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as local:
        yield local.scheduler_address


def points() -> list[Point]:
    """Return the configured machine, and ones with less oil stiffness."""
    model = knee_model()
    place = (model.kernel.parameters.names or ()).index("oil_bulk_modulus")
    made = []
    for factor in (1.0, 0.9, 0.8, 0.7):
        par = model.par.copy()
        par[place] *= factor
        made.append((par, model.chan.copy()))
    return made


def test_threads_do_not_change_a_residual() -> None:
    """One thread or three, several points or one: the same numbers in the same order."""
    observer = Observer(knee_model(), INSTRUMENTS)
    logs = [recorded({}, kind, 1, 0.5) for kind in ("steps", "multisine")]
    one, three = (Threads(observer, jobs).freeze(logs, points()[0]) for jobs in (1, 3))
    together = list(one.residuals(points()))
    assert all(map(np.array_equal, together, three.residuals(points())))
    assert np.array_equal(next(three.residuals(points()[:1])), together[0])
    alone = [next(Threads(observer).freeze([e], points()[0]).residuals(points())) for e in logs]
    assert np.array_equal(np.concatenate(alone), together[0])


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_point_that_is_too_far_off_is_given_up(jobs: int) -> None:
    """Such a point exceeds the limit and lacks its last experiments; nearer points are complete."""
    observer = Observer(knee_model(), INSTRUMENTS)
    logs = [recorded({}, kind, 1, 0.5) for kind in ("steps", "multisine", "triangles")]
    batch = Threads(observer, jobs).freeze(logs, points()[0])
    whole = list(batch.residuals(points()))
    losses = [float(r @ r) for r in whole]
    most = 0.5 * (min(losses) + max(losses))
    for full, residual, loss in zip(whole, batch.residuals(points(), most), losses, strict=True):
        assert np.array_equal(residual, full[: len(residual)])
        assert len(residual) == len(full) if loss <= most else float(residual @ residual) > most
    if jobs == 1:  # three threads begin all of them at once
        assert len(next(batch.residuals(points()[-1:], 0.0))) < len(whole[-1])


def test_an_effect_of_the_user_travels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the file is not, its content gives the same effect in a module of the same name."""
    file = tmp_path / "drag.py"
    file.write_text(OWN)
    (original,) = read_effects(file, OWN.encode())
    files = effect_files([original])
    monkeypatch.delitem(sys.modules, original.law.__module__)
    (effect,) = restored(files, tmp_path)
    assert effect.name == original.name == "dry_drag"
    assert effect.law is not original.law
    assert effect.law.__module__ == original.law.__module__


@pytest.mark.parametrize("command", ["identify", "gap"])
def test_an_address_without_a_scheduler(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One message with address and way out, exit code 2, no traceback."""
    monkeypatch.setattr(cluster, "CONNECTING", 0.3)
    done = CliRunner().invoke(main, [command, str(RIG), str(LOG), "--cluster=tcp://127.0.0.1:1"])
    assert done.exit_code == 2
    assert "tcp://127.0.0.1:1: cannot be reached" in done.output
    assert "leave --cluster out" in done.output
    assert "Traceback" not in done.output


@pytest.mark.slow
def test_the_result_is_the_same_on_a_cluster(workers: str) -> None:
    """Names, values, chi-square and all else: as without a cluster."""
    train, other = campaign({"internal_leakage_conductance": 1e-13})
    only = Question(only=["internal_leakage", "external_leakage"])
    here = identify(knee(), train, other, only, cache=CACHE)
    there = identify(knee(), train, other, only, cache=CACHE, cluster=workers)
    assert [f.name for f in here.effects] == ["internal_leakage"]
    assert there.to_dict() == here.to_dict()
    assert here.search is not None
    assert there.search is not None
    assert here.search.final is not None
    assert there.search.final is not None
    assert there.search.final.chi2 == here.search.final.chi2
    assert np.array_equal(there.search.final.at, here.search.final.at)


@pytest.mark.full(sibling="platform/test_cluster.py::test_a_task_that_kills_workers")
def test_a_worker_that_dies_is_made_up_for(workers: str) -> None:
    """The experiments of a dead worker are frozen again; the residuals are the same."""
    observer = Observer(knee_model(), INSTRUMENTS)
    logs = [recorded({}, kind, 1, 0.5) for kind in ("steps", "multisine", "triangles")]
    here = Threads(observer).freeze(logs, points()[0])
    with connected(workers) as client:
        there = ClusterPool(client, observer).freeze(logs, points()[0])
        assert all(map(np.array_equal, here.residuals(points()), there.residuals(points())))
        os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
        assert all(map(np.array_equal, here.residuals(points()), there.residuals(points())))
        for mine, fetched in zip(here.frozen, there.frozen, strict=True):
            assert np.array_equal(mine.gains.kalman, fetched.gains.kalman)


@pytest.mark.full(sibling="test_the_result_is_the_same_on_a_cluster")
def test_workers_share_a_noise(workers: str) -> None:
    """Noise that logs on several workers show weighs all of them, as in one process."""
    observer = StaticObserver(knee_model())
    logs = [recorded({}, kind, 1, 0.5) for kind in ("steps", "multisine")]
    point = points()[0]
    here = Threads(observer).freeze(logs, point)
    with connected(workers) as client:
        there = ClusterPool(client, observer).freeze(logs, point)
        assert here.noise is not None
        assert there.noise is not None
        assert there.noise.density == here.noise.density
        (residual,) = there.residuals([point])
        assert np.array_equal(residual, next(here.residuals([point])))
        less = here.noise.left(0.5 * residual)
        assert less.density == pytest.approx(0.25 * here.noise.density)
        assert next(there.sharing(less).residuals([point])) == pytest.approx(2.0 * residual)
