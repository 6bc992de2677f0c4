"""Foreign devices: correct devices pass, and a violation fails the case of its clause."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from constant_node import make_node, stepper
from foreign_device import NODE_ID, LocalDevice, write_eds
from suite import SUITE, Results, own_channel, run_in_lock_step

from hil_emulator.__main__ import main
from hil_emulator.bus.bus import Bus
from hil_emulator.conformance.cases import CASES
from hil_emulator.conformance.plugin import _ABORT_CODE
from hil_emulator.conformance.wire import SteppedTime, Wire
from hil_emulator.platform.paths import shipped

FAULTS = {
    "2.5": "sub-index 1 of a variable is answered (0609 0011, CiA 301 7.2.4.3.17)",
    "2.13": "a segment after the last is answered (0504 0001)",
    "2.17": "an aborted upload goes on",
    "2.19": "a block upload is answered as a segmented one (0504 0001)",
    "2.302": "sub-index 1 of a variable is answered",
    "2.304": "a transfer goes on after the client's abort (7.2.4.3.17)",
    "2.316": "sub-index 1 of a variable is refused as read-only (0609 0011)",
    "2.317": "the segment after the last is answered (0504 0001)",
    "2.305": "the server waits for ever (0504 0000)",
    "4.5": "sub-index 255 of a variable is answered with its value",
    "9.4": "SDO is answered in STOPPED (7.3.2.2.4)",
    "9.301": "an NMT message of another length ends the program (7.2.8.3.1)",
    "10.4": "SDO is answered in STOPPED",
}
"""Violations of CiA 301 by `canopen.LocalNode` 2.4.1, by the case that detects them."""


def without(text: str, *indices: str) -> str:
    """Return an EDS without some objects: their sections and their places in the lists."""
    for index in indices:
        head, _, tail = text.partition(f"\n[{index}]")
        assert tail, index
        rest = tail[tail.index("\n[") :]
        while rest.startswith(f"\n[{index}sub"):
            rest = rest[rest.index("\n[", 1) :]
        text = head + rest
        lines = text.split("\n")
        (place,) = [n for n, line in enumerate(lines) if line.endswith(f"=0x{index}")]
        start = max(n for n in range(place) if lines[n].startswith("SupportedObjects"))
        count = int(lines[start].split("=")[1])
        listed = [line.split("=")[1] for line in lines[start + 1 : start + 1 + count]]
        listed.remove(f"0x{index}")
        lines[start] = f"SupportedObjects={count - 1}"
        lines[start + 1 : start + 1 + count] = [f"{n}={i}" for n, i in enumerate(listed, start=1)]
        text = "\n".join(lines)
    return text


def run_on(device: LocalDevice, eds: Path, *options: str) -> tuple[int, Results]:
    """Run the suite on a foreign device; return pytest's exit code and the results."""
    results = Results(None, device.step, set(CASES))  # type: ignore[arg-type]
    results.wire = Wire(device, SteppedTime(device.step))
    where = ["--node", str(NODE_ID), "--eds", str(eds), "-q", "--no-header", "--tb=no", "-rN"]
    return pytest.main([*SUITE, *where, *options], plugins=[results]), results


def test_a_local_node_fails_for_its_faults_alone(tmp_path: Path) -> None:
    """Every failure of `canopen.LocalNode` is a clause that it violates; all other cases pass."""
    eds = write_eds(tmp_path / "local.eds")
    _, results = run_on(LocalDevice(eds), eds)
    failed = {name for name, outcome in results.outcomes.items() if outcome == "failed"}
    assert failed == set(FAULTS), "\n".join(results.remarks)
    assert sum(outcome == "passed" for outcome in results.outcomes.values()) >= 60


def test_a_device_without_optional_services_passes(tmp_path: Path) -> None:
    """Without SYNC, EMCY and TIME in its EDS their cases do not apply, and no case fails.

    The heartbeat time is mappable, as in some makers' files; no case writes patterns to it.
    """
    text = without(shipped("eds/pressure_transmitter.eds").read_text(), "1005", "1014", "1012")
    head, _, tail = text.partition("[1017]")
    eds = tmp_path / "plain.eds"
    eds.write_text(f"{head}[1017]{tail.replace('PDOMapping=0', 'PDOMapping=1', 1)}")
    settings = own_channel()
    with Bus(settings) as port, Bus(settings) as peer:
        results = run_in_lock_step(peer, stepper(make_node(eds, NODE_ID), port), NODE_ID, eds)
    assert "failed" not in results.outcomes.values(), "\n".join(results.remarks)
    assert results.outcomes["6.3"] == results.outcomes["5.4"] == "skipped"


def test_reasons_are_printed_as_cases_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run that stops after its first failure has printed the case and the reason."""
    eds = write_eds(tmp_path / "local.eds")
    run_on(LocalDevice(eds), eds, "-x", "--case", "2.5")
    report = capsys.readouterr().out
    line = "SDO 05: refuse a sub-index that does not exist: failed: assert 0 in {"
    assert line in report.partition("CANopen conformance")[0]


@pytest.mark.slow
def test_a_self_starting_device_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A device that is OPERATIONAL after boot-up is named before the first case."""
    eds = write_eds(tmp_path / "local.eds")
    device = LocalDevice(eds, self_starting=True)
    run_on(device, eds, "--case", "2.1")
    assert "add --self-starting if this is intended" in capsys.readouterr().out
    run_on(device, eds, "--case", "2.1", "--self-starting")
    assert "--self-starting" not in capsys.readouterr().out


def test_a_wrong_node_id_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """If no device answers, no case is run."""
    eds = write_eds(tmp_path / "local.eds")
    device = LocalDevice(eds)
    code, results = run_on(device, eds, "--node", "13")
    assert (code, results.outcomes) == (4, {})
    assert "no device answers at node-ID 13" in capsys.readouterr().out


def test_the_command_reports_that_no_device_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command ends with exit code 2 and the reason."""
    monkeypatch.setattr("hil_emulator.conformance.device.BOOT_MS", 1)
    eds = str(shipped("eds/load_cell.eds"))
    bus = ["--can", "virtual:empty"]
    result = CliRunner().invoke(main, ["conformance", *bus, "--node", "13", "--eds", eds])
    assert result.exit_code == 2
    assert "no device answers at node-ID 13" in result.output.splitlines()[-1]


def test_abort_codes_are_shown_in_hexadecimal_once() -> None:
    """A hexadecimal abort code is unchanged."""
    assert _ABORT_CODE.findall("abort 06090030, 101253168") == ["101253168"]
