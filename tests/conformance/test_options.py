"""The options of the suite."""

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
    """python-can receives the arguments of --can and --can-option, numbers as numbers."""
    settings = bus_settings("socketcand:can0", ["host=127.0.0.1", "port=29536"])
    assert settings == {
        "interface": "socketcand",
        "channel": "can0",
        "host": "127.0.0.1",
        "port": 29536,
    }


@pytest.mark.parametrize("can", ["socketcan", ":can0", "socketcan:"])
def test_an_address_has_two_parts(can: str) -> None:
    """An address without interface or channel is refused, with a correct example."""
    with pytest.raises(UserError, match="write interface:channel, such as socketcan:can0"):
        bus_settings(can, [])


def test_an_option_has_a_value() -> None:
    """An option that is not key=value is refused, with a correct example."""
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
def test_the_suite_names_missing_options(
    options: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without an address, a device or its EDS no case is run, and one sentence has the reason."""
    code = pytest.main([*SUITE, *options])
    assert code == pytest.ExitCode.USAGE_ERROR
    report = "".join(capsys.readouterr())
    assert complaint in report
    assert "passed" not in report


def test_the_command_names_missing_options(tmp_path: Path) -> None:
    """Without an EDS that can be read the command ends with exit code 2, and no case is run."""
    missing = str(tmp_path / "missing.eds")
    result = CliRunner().invoke(
        main, ["conformance", "--can", "virtual:1", "--node", "5", "--eds", missing]
    )
    assert result.exit_code == 2
    assert f"cannot read the EDS {missing}" in result.output
    assert "passed" not in result.output


def test_the_command_explains_its_options() -> None:
    """The options of the suite are in the help of the command."""
    output = CliRunner().invoke(main, ["conformance", "--help"]).output
    for option in ("--can", "--node", "--eds", "--case", "--self-starting", "--storm", "--html"):
        assert option in output
