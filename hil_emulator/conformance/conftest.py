"""The device under test, reset for every case."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import cache
from typing import NamedTuple

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.conformance.device import OPERATIONAL, PRE_OPERATIONAL, Device
from hil_emulator.conformance.expectation import Expectation
from hil_emulator.conformance.identity import about
from hil_emulator.conformance.keeping import Values, forget_stored, parameters, put_back
from hil_emulator.conformance.plugin import ABOUT, CALM, announce
from hil_emulator.conformance.storm import Storm
from hil_emulator.conformance.wire import NO_REMOTE_FRAMES, WallTime, Wire
from hil_emulator.errors import UserError


class Kept(NamedTuple):
    """The device, and its parameters before the first case."""

    device: Device
    values: Values


HERE = {"host": "127.0.0.1", "port": 29536}
"""Default address of a socketcand server: that of `hil-emulator run` without options."""
_SELF_STARTING = (
    "note: the device is OPERATIONAL after boot-up; add --self-starting if this is intended. "
    "Each case begins in PRE-OPERATIONAL."
)


def bus_settings(can: str, options: list[str]) -> Mapping[str, object]:
    """Return the settings of a bus from `--can` and `--can-option`.

    Raises:
        UserError: an option has the wrong form.

    """
    interface, colon, channel = can.partition(":")
    if not (interface and colon and channel):
        raise UserError(f"--can {can}: write interface:channel, such as socketcan:can0")
    settings: dict[str, object] = {"interface": interface, "channel": channel}
    if interface == "socketcand":
        settings |= HERE
    for option in options:
        key, equals, value = option.partition("=")
        if not (key and equals):
            raise UserError(f"--can-option {option}: write key=value, such as port=29536")
        settings[key] = int(value) if value.isdecimal() else value
    return settings


@pytest.fixture(scope="session")
def eds(request: pytest.FixtureRequest) -> Expectation:
    """Return the content of the EDS."""
    path, node_id = request.config.getoption("--eds"), request.config.getoption("--node")
    if path is None or node_id is None:
        pytest.exit("the conformance suite needs --eds FILE and --node ID", 4)
    try:
        return Expectation(path, node_id)
    except UserError as error:
        pytest.exit(str(error), 4)


@pytest.fixture(scope="session")
def wire(request: pytest.FixtureRequest, eds: Expectation) -> Iterator[Wire]:
    """Yield the suite's connection to the bus, opened after the check of the options."""
    given = request.config.hook.pytest_conformance_wire(config=request.config)
    if given is not None:
        yield given
        return
    can, options = request.config.getoption("--can"), request.config.getoption("--can-option")
    if can is None:
        pytest.exit("the conformance suite needs --can INTERFACE:CHANNEL", 4)
    with ExitStack() as stack:
        try:
            settings = bus_settings(can, options)
            bus = stack.enter_context(Bus(settings))
        except UserError as error:
            pytest.exit(str(error), 4)
        remote_frames = settings["interface"] not in NO_REMOTE_FRAMES
        yield Wire(bus, WallTime(), remote_frames=remote_frames)


@pytest.fixture(scope="session")
def kept(request: pytest.FixtureRequest, eds: Expectation, wire: Wire) -> Kept:
    """Return the device, and the parameters that it started with."""
    device = Device(wire, request.config.getoption("--node"), eds)
    if not (device.boots() or device.answers()):
        pytest.exit(f"no device answers at node-ID {device.node_id}", 4)
    device.self_starting = device.state_after_boot() == OPERATIONAL
    if device.self_starting and not request.config.getoption("--self-starting"):
        announce(request.config, _SELF_STARTING)
    device.reset()
    request.config.stash[ABOUT] += about(device)
    return Kept(device, parameters(device))


@pytest.fixture(scope="session")
def restored(kept: Kept) -> Iterator[Device]:
    """Yield the device without stored parameters; its parameters are put back at the end."""
    kept.device.restore_defaults()
    yield kept.device
    put_back(*kept)


@pytest.fixture
def weather(request: pytest.FixtureRequest) -> str:
    """Return the round of the case: before or after the random frames of `--storm`."""
    return str(getattr(request, "param", CALM))


@pytest.fixture(scope="session")
def storm(request: pytest.FixtureRequest, restored: Device) -> Callable[[], None]:
    """Return a function that sends the random frames of `--storm` in its first call."""
    return cache(lambda: Storm(restored).rage(request.config.getoption("--storm")))


@pytest.fixture
def device(restored: Device, weather: str, storm: Callable[[], None]) -> Device:
    """Return the device, just booted."""
    if weather != CALM:
        storm()
    restored.wire.forget()
    restored.reset()
    restored.wire.forget()
    return restored


@pytest.fixture
def storing(device: Device, kept: Kept) -> Iterator[Device]:
    """Yield the device; parameters that a case stores are deleted afterwards."""
    yield device
    device.enter(PRE_OPERATIONAL)
    forget_stored(*kept)
