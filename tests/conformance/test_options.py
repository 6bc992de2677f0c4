"""What the suite asks of its user."""

import pytest
from suite import SUITE

from hil_emulator.conformance.conftest import bus_settings
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped

DEVICE = ["--node", "5", "--eds", str(shipped("eds/hydraulic_actuator.eds"))]


def test_python_can_gets_its_arguments() -> None:
    """What --can and --can-option say is what python-can is opened with, numbers as numbers."""
    settings = bus_settings("socketcand:can0", ["host=127.0.0.1", "port=29536"])
    assert settings == {
        "interface": "socketcand",
        "channel": "can0",
        "host": "127.0.0.1",
        "port": 29536,
    }


@pytest.mark.parametrize("can", ["socketcan", ":can0", "socketcan:"])
def test_an_address_has_two_parts(can: str) -> None:
    """An address without interface or channel is refused, with an example of a right one."""
    with pytest.raises(UserError, match="write interface:channel, such as socketcan:can0"):
        bus_settings(can, [])


def test_an_option_has_a_value() -> None:
    """An option that is no key=value is refused, with an example of a right one."""
    with pytest.raises(UserError, match="write key=value, such as port=29536"):
        bus_settings("socketcan:can0", ["port"])


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([], "needs --eds FILE and --node ID"),
        (DEVICE, "needs --can INTERFACE:CHANNEL"),
        (["--can", "nonsense:1", *DEVICE], "interface = 'nonsense' is unknown"),
        ([*DEVICE[:2], "--eds", "missing.eds"], "cannot read the EDS missing.eds"),
    ],
)
def test_the_suite_says_what_it_needs(
    options: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without an address, a device or its EDS no case is run, and one sentence says why."""
    code = pytest.main([*SUITE, *options])
    assert code == pytest.ExitCode.USAGE_ERROR
    report = "".join(capsys.readouterr())
    assert complaint in report
    assert "passed" not in report
