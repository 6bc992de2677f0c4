"""The reference machine on the bench, every procedure performed once per session."""

from collections.abc import Callable
from pathlib import Path

import pytest

import hil_emulator
from hil_emulator.characterise.registry import bench_tests
from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.stand import Bench
from hil_emulator.config.load import Configuration, load
from hil_emulator.model.kernel import Kernel, build
from hil_emulator.platform.paths import cache_folder


@pytest.fixture(scope="session")
def cache() -> Path:
    """Return the folder that keeps compiled models from one session to the next."""
    return cache_folder()


@pytest.fixture(scope="session")
def reference() -> Configuration:
    """Return the reference machine's configuration."""
    return load([Path(hil_emulator.__file__).parents[1] / "configs" / "hyq_knee.toml"])


@pytest.fixture(scope="session")
def kernel(reference: Configuration, cache: Path) -> Kernel:
    """Return the compiled model."""
    return build(reference.effects, cache)


@pytest.fixture(scope="session")
def bench(reference: Configuration, kernel: Kernel) -> Callable[..., Bench]:
    """Return a function that puts the reference machine, with changes, on the bench."""

    def put(**changes: float) -> Bench:
        return Bench(kernel, reference.plant | changes, reference.sensors, seed=1)

    return put


@pytest.fixture(scope="session")
def results(bench: Callable[..., Bench]) -> Callable[[str], BenchResult]:
    """Return a function that gives a procedure's result, performed at most once."""
    procedures = {test.name: test for test in bench_tests()}
    done: dict[str, BenchResult] = {}

    def result(name: str) -> BenchResult:
        if name not in done:
            done[name] = procedures[name].run(bench())
        return done[name]

    return result
