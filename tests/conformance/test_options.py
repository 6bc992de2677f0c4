"""What the suite asks of its user."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from suite import SUITE

from hil_emulator.__main__ import main
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


def test_the_command_says_what_it_needs(tmp_path: Path) -> None:
    """Without an EDS that can be read the command ends with exit code 2, and no case is run."""
    missing = str(tmp_path / "missing.eds")
    told = CliRunner().invoke(
        main, ["conformance", "--can", "virtual:1", "--node", "5", "--eds", missing]
    )
    assert told.exit_code == 2
    assert f"cannot read the EDS {missing}" in told.output
    assert "passed" not in told.output


def test_the_command_explains_its_options() -> None:
    """What can be asked of the suite is in its own help, not in pytest's alone."""
    told = CliRunner().invoke(main, ["conformance", "--help"]).output
    for option in ("--can", "--node", "--eds", "--case", "--self-starting", "--storm", "--html"):
        assert option in told
