"""The device under test, freshly reset for every case."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.conformance.device import PRE_OPERATIONAL, Device
from hil_emulator.conformance.expectation import Expectation
from hil_emulator.conformance.wire import NO_REMOTE_FRAMES, WallTime, Wire
from hil_emulator.errors import UserError


def bus_settings(can: str, options: list[str]) -> Mapping[str, object]:
    """Return the settings of a bus from `--can` and `--can-option`.

    Raises:
        UserError: one of them is not what it has to look like.

    """
    interface, colon, channel = can.partition(":")
    if not (interface and colon and channel):
        raise UserError(f"--can {can}: write interface:channel, such as socketcan:can0")
    settings: dict[str, object] = {"interface": interface, "channel": channel}
    for option in options:
        key, equals, value = option.partition("=")
        if not (key and equals):
            raise UserError(f"--can-option {option}: write key=value, such as port=29536")
        settings[key] = int(value) if value.isdecimal() else value
    return settings


@pytest.fixture(scope="session")
def eds(request: pytest.FixtureRequest) -> Expectation:
    """Return what the device promises."""
    path, node_id = request.config.getoption("--eds"), request.config.getoption("--node")
    if path is None or node_id is None:
        pytest.exit("the conformance suite needs --eds FILE and --node ID", 4)
    try:
        return Expectation(path, node_id)
    except UserError as error:
        pytest.exit(str(error), 4)


@pytest.fixture(scope="session")
def wire(request: pytest.FixtureRequest, eds: Expectation) -> Iterator[Wire]:
    """Yield the suite's place on the bus, opened once it is clear what is to be tested."""
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
def found(request: pytest.FixtureRequest, eds: Expectation, wire: Wire) -> Device:
    """Return the device, with nothing stored in it and all parameters at their defaults."""
    device = Device(wire, request.config.getoption("--node"), eds)
    device.reset()
    device.restore_defaults()
    return device


@pytest.fixture
def device(found: Device) -> Device:
    """Return the device, just booted."""
    found.wire.forget()
    found.reset()
    found.wire.forget()
    return found


@pytest.fixture
def storing(device: Device) -> Iterator[Device]:
    """Yield the device; what a case stores in it is forgotten afterwards."""
    yield device
    device.enter(PRE_OPERATIONAL)
    device.restore_defaults()
