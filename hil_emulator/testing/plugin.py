"""The pytest plugin: fixtures, and the report of a failing test.

Modules are imported only when a test uses them, because the plugin is loaded wherever the package
is installed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from hil_emulator.config.load import Configuration
    from hil_emulator.faults.running import Running
    from hil_emulator.scenario.outcome import Outcome
    from hil_emulator.simulation.emulator import Emulator, Signals, Time
    from hil_emulator.testing.lockstep_network import LockStepNetwork
    from hil_emulator.testing.process import EmulatorProcess

_MARK = "emulator"
_REFERENCE = "configs/hyq_knee.toml"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options."""
    group = parser.getgroup("hil-emulator")
    group.addoption(
        "--emulator-config",
        action="append",
        default=[],
        metavar="CONFIG",
        help="configuration of the emulator, a file or the name of a packaged one; may be "
        "repeated, later ones over earlier ones",
    )
    group.addoption("--emulator-seed", type=int, metavar="N", help="seed of the sensor noise")


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line(
        "markers",
        "emulator(*files, seed=None, clock='wall', bus=None): configuration of the emulator for a "
        "test; clock and bus are those of emulator_process",
    )


def _files(request: pytest.FixtureRequest) -> list[Path]:
    """Return the configuration files: of the marker, else of the option, else the reference."""
    from hil_emulator.platform.packaged import CONFIGURATIONS, found
    from hil_emulator.platform.paths import shipped

    mark = request.node.get_closest_marker(_MARK)
    if mark is not None and mark.args:
        return [_found(request, name) for name in mark.args]
    chosen = request.config.getoption("--emulator-config")
    return [found(name, *CONFIGURATIONS) for name in chosen] or [shipped(_REFERENCE)]


def _found(request: pytest.FixtureRequest, name: str) -> Path:
    """Return a file of a marker: next to the test, below the root, or a packaged one."""
    from hil_emulator.errors import UserError
    from hil_emulator.platform.packaged import CONFIGURATIONS, packaged
    from hil_emulator.platform.paths import shipped

    for folder in (request.path.parent, request.config.rootpath):
        if (folder / name).is_file():
            return folder / name
    try:
        return packaged(*CONFIGURATIONS).get(name) or shipped(name)
    except UserError:
        raise UserError(
            f"@pytest.mark.{_MARK}: {name}: no such file next to the test, in "
            f"{request.config.rootpath} or in the package; see `hil-emulator configs`"
        ) from None


@pytest.fixture
def emulator_config(request: pytest.FixtureRequest) -> Configuration:
    """Return the configuration of the emulator; override this fixture to choose another."""
    from hil_emulator.config.load import load_rig

    config = load_rig(_files(request))
    mark = request.node.get_closest_marker(_MARK)
    seed = request.config.getoption("--emulator-seed")
    if seed is None and mark is not None:
        seed = mark.kwargs.get("seed")
    return config if seed is None else dataclasses.replace(config, seed=seed)


@pytest.fixture
def emulator(emulator_config: Configuration) -> Iterator[Emulator]:
    """Yield an emulator in lock-step, on a virtual bus of its own."""
    from hil_emulator.simulation.emulator import Emulator

    with Emulator(emulator_config) as made:
        yield made


@pytest.fixture
def can_bus(emulator: Emulator) -> Iterator[Any]:
    """Yield a python-can bus on the emulator's bus; frames arrive with the next tick."""
    from hil_emulator.bus.opening import open_can_bus

    bus = open_can_bus(emulator.bus)
    yield bus
    bus.shutdown()


@pytest.fixture
def network(emulator: Emulator) -> Iterator[LockStepNetwork]:
    """Yield a connected `canopen.Network` with the emulator's nodes and their EDS."""
    from hil_emulator.config.nodes import UNCONFIGURED
    from hil_emulator.testing.known_objects import known_objects
    from hil_emulator.testing.lockstep_network import LockStepNetwork

    made = LockStepNetwork(emulator)
    for settings, node in zip(emulator.config.nodes, emulator.rig.nodes, strict=True):
        if settings.id != UNCONFIGURED:
            made.add_node(settings.id, known_objects(settings.eds, node.dictionary))
    emulator.tick()  # the boot-up message
    yield made
    made.disconnect()


@pytest.fixture
def run_for(emulator: Emulator) -> Callable[[Time], None]:
    """Return a function that lets emulator time pass: `run_for("200 ms")`."""
    return emulator.run_for


@pytest.fixture
def wait_until(
    emulator: Emulator,
) -> Callable[[str | Callable[[Signals], bool], Time], float]:
    """Return a function that lets time pass until a condition holds, or fails."""
    return emulator.wait_until


@pytest.fixture
def inject(emulator: Emulator) -> Callable[..., Running]:
    """Return a function that injects a fault: `inject("pressure_a", "stuck")`."""
    return emulator.fault


@pytest.fixture
def play_scenario(request: pytest.FixtureRequest) -> Callable[..., list[Outcome]]:
    """Return a function that plays a scenario next to the test, and fails if it is not passed.

    `play_scenario("step.toml", connect)` connects a controller in Python, as `hil.play` does.
    """
    from hil_emulator.scenario.loading import runs_of
    from hil_emulator.scenario.perform import Connect, perform
    from hil_emulator.scenario.report import failures

    def play(file: str | Path, connect: Connect | None = None) -> list[Outcome]:
        path = request.path.parent / file
        outcomes = [perform(path, run=run, connect=connect) for run in range(len(runs_of(path)))]
        missed = failures(outcomes)
        if missed:
            pytest.fail("\n".join(missed), pytrace=False)
        return outcomes

    return play


@pytest.fixture
def emulator_process(request: pytest.FixtureRequest) -> Iterator[EmulatorProcess]:
    """Yield an emulator in a separate process, for controllers that are processes too."""
    from hil_emulator.testing.process import EmulatorProcess

    mark = request.node.get_closest_marker(_MARK)
    chosen = dict(mark.kwargs) if mark is not None else {}
    clock, bus = chosen.get("clock", "wall"), chosen.get("bus")
    with EmulatorProcess(_files(request), clock, bus) as process:
        yield process


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the emulator's state to the report of a failing test."""
    made = yield
    emulator = getattr(item, "funcargs", {}).get("emulator")
    if made.when == "call" and made.failed and emulator is not None:
        from hil_emulator.testing import report

        file = report.keep(emulator, item.nodeid, item.config.rootpath / report.FOLDER)
        made.sections.append(("emulator", report.report(emulator, item.nodeid, file)))
    return made
