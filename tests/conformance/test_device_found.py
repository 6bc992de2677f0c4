"""State of a device before and after the suite."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from constant_node import make_node, stepper
from every_service import every_service
from mutations import MUTANTS
from suite import Results, own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus
from hil_emulator.device.node import Node

NODE = 5
HEARTBEAT = (0x1017, 0)
MAPPED = (0x1A00, 1)
POSITION = 0x2020_0020


@pytest.fixture
def eds(tmp_path: Path) -> Path:
    """Return the EDS of a device that has every service."""
    return every_service(tmp_path)


@contextmanager
def bus() -> Iterator[tuple[Bus, Bus]]:
    """Yield the device's and the suite's port on a virtual bus."""
    settings = own_channel()
    with Bus(settings) as port, Bus(settings) as peer:
        yield port, peer


def run(node: Node, eds: Path, *more: str, only: set[str] | None = None) -> Results:
    """Run cases on a node."""
    with bus() as (port, peer):
        return run_in_lock_step(peer, stepper(node, port), NODE, eds, only, more=more)


@pytest.mark.slow
def test_stored_parameters_are_kept(eds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters and mappings stored by a user are kept, also after failed cases."""
    node = make_node(eds, NODE)
    for index, subindex, value in (
        (*HEARTBEAT, 777),
        (0x1800, 1, 0x8000_0185),
        (0x1A00, 0, 0),
        (*MAPPED, POSITION),
        (0x1A00, 0, 1),
        (0x1800, 1, 0x185),
        (0x2001, 0, -5),
        (0x1010, 1, int.from_bytes(b"save", "little")),
    ):
        node.dictionary.write(index, subindex, value)
    parameters = [entry for entry in node.dictionary if entry.writable]
    before = {entry: entry.value for entry in parameters}
    MUTANTS["emcy_history_not_cleared"].apply(monkeypatch)
    results = run(node, eds, only={"3.22", "5.305", "8.2", "8.301"})
    assert results.outcomes["5.305"] == "failed"
    assert {entry: entry.value for entry in parameters} == before


@pytest.mark.slow
def test_self_starting_devices_pass(eds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that enters OPERATIONAL by itself passes if 0x1F80 or the option allows it."""
    MUTANTS["nmt_starts_by_itself"].apply(monkeypatch)
    some = {"3.22", "4.2", "6.3", "9.2", "10.1", "10.4", "9.302"}
    refused = run(make_node(eds, NODE), eds, only=some)
    assert {case for case, outcome in refused.outcomes.items() if outcome == "failed"} == {"9.2"}
    accepted = run(make_node(eds, NODE), eds, "--self-starting", only=some)
    assert set(accepted.outcomes.values()) == {"passed"}, accepted.remarks


def test_a_page_is_written(eds: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page has device, verdict and each case with its reason, in the order of the chapters."""
    MUTANTS["lss_any_node_id"].apply(monkeypatch)
    path = tmp_path / "report.html"
    run(make_node(eds, NODE), eds, "--conformance-html", str(path), only={"11.5", "2.7", "12.5"})
    text = path.read_text()
    assert "Hydraulic actuator emulator" in text
    assert "1 case failed" in text
    assert "node-ID 0 was taken" in text
    assert text.index("2.7 SDO 07") < text.index("11.5 LSS 05") < text.index("12.5 TIME 05")


def test_a_device_passes_after_random_frames(eds: Path) -> None:
    """After 5000 random frames a correct device passes all cases again."""
    results = run(make_node(eds, NODE), eds, "--storm", "5000", only={"1.0", "2.7", "3.301", "4.2"})
    assert set(results.outcomes.values()) == {"passed"}, results.remarks
    assert results.runs == 8


def test_a_device_that_a_case_left_stopped_is_put_back(eds: Path) -> None:
    """If the last case stops the device its parameters are still restored."""
    assert run(make_node(eds, NODE), eds, only={"7.305"}).outcomes == {"7.305": "passed"}
