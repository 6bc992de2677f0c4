"""Stored parameters on disk are kept over a restart; damaged or foreign files are not used."""

import json
from pathlib import Path

import pytest

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.simulation.parameter_store import ParameterFile

EDS = Path(__file__).parents[2] / "eds"
CHANNELS = ("load_force",)
HEARTBEAT = 0x1017


def started(
    path: Path, messages: list[str], eds: str = "load_cell.eds", number: int = 6
) -> tuple[Node, Dictionary]:
    """Return a node that keeps its parameters in a file."""
    dictionary = Dictionary.from_eds(EDS / eds, number)
    storage = ParameterFile(path, dictionary, messages.append)
    channels = CHANNELS if eds == "load_cell.eds" else ("position",)
    return Node(dictionary, channels, {}, storage), dictionary


def request(node: Node, text: str) -> bytes:
    """Return the answer to an expedited SDO request given in hexadecimal."""
    sample = Measured([0.0], [0])
    node.publish(0, sample)
    node.receive(0, [Frame(0x600 + node.node_id, bytes.fromhex(text))])
    answers = [f.data for f in node.publish(0, sample) if f.can_id == 0x580 + node.node_id]
    return answers[0]


def saved(path: Path) -> None:
    """Set the heartbeat to 0x1234 ms by SDO and save."""
    node, _ = started(path, [])
    assert request(node, "2b17100034120000")[0] == 0x60
    assert request(node, "2310100173617665")[0] == 0x60


def heartbeat(path: Path, messages: list[str], **options: str) -> int:
    """Return the heartbeat time of a node after its start."""
    _, dictionary = started(path, messages, **options)
    return int(dictionary.entry(HEARTBEAT).value)


def test_saved_parameters_survive_a_restart(tmp_path: Path) -> None:
    """A new process uses the saved parameters without a message."""
    messages: list[str] = []
    saved(tmp_path / "made" / "node6.json")
    assert heartbeat(tmp_path / "made" / "node6.json", messages) == 0x1234
    assert messages == []


def test_restoring_survives_a_restart(tmp_path: Path) -> None:
    """After "load" a new process starts with the defaults."""
    path = tmp_path / "node6.json"
    saved(path)
    node, _ = started(path, [])
    assert request(node, "231110016c6f6164")[0] == 0x60
    assert heartbeat(path, []) == 100


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.999])
def test_a_torn_file_is_not_used(tmp_path: Path, share: float) -> None:
    """The message names a truncated file once, and the defaults are used."""
    path, messages = tmp_path / "node6.json", []
    saved(path)
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    assert heartbeat(path, messages) == 100
    assert len(messages) == 1
    assert str(path) in messages[0]
    assert "node 6 starts with defaults" in messages[0]


def test_a_changed_value_is_detected(tmp_path: Path) -> None:
    """A file with a flipped bit is not used."""
    path, messages = tmp_path / "node6.json", []
    saved(path)
    content = json.loads(path.read_text())
    content["values"]["1017:00"] = "3512"
    path.write_text(json.dumps(content))
    assert heartbeat(path, messages) == 100
    assert "checksum" in messages[0]


@pytest.mark.parametrize("junk", [b"\xff\xfe\x00", b"[]", b"{}", b'"text"', b"null", b"1"])
def test_a_file_of_something_else_is_not_used(tmp_path: Path, junk: bytes) -> None:
    """The node starts with any content of the file."""
    path, messages = tmp_path / "node6.json", []
    path.write_bytes(junk)
    assert heartbeat(path, messages) == 100
    assert len(messages) == 1


def test_another_devices_file_is_not_used(tmp_path: Path) -> None:
    """A position sensor does not use the parameters of a load cell, and does not change them."""
    path, messages = tmp_path / "node.json", []
    saved(path)
    before = path.read_bytes()
    assert heartbeat(path, messages, eds="position_sensor.eds") == 100
    assert "another device" in messages[0]
    assert path.read_bytes() == before


def test_a_refused_file_keeps_its_content_under_another_name(tmp_path: Path) -> None:
    """Saving replaces a refused file and keeps its content under another name."""
    path, messages = tmp_path / "node6.json", []
    path.write_text("torn")
    saved(path)
    saved(path)
    assert heartbeat(path, messages) == 0x1234
    assert messages == []
    kept = [file for file in tmp_path.iterdir() if file != path]
    assert [file.suffix for file in kept] == [".refused"]
    assert kept[0].read_text() == "torn"


def test_a_crash_while_writing_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The new file is written completely or not at all; the SDO is aborted."""
    path = tmp_path / "node6.json"
    saved(path)
    before = path.read_bytes()
    node, _ = started(path, [])

    def power_off(descriptor: int) -> None:
        raise OSError

    monkeypatch.setattr("os.fsync", power_off)
    assert request(node, "2310100173617665")[4:] == bytes.fromhex("00000606")
    assert path.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    """The message has the file and the remedy."""
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"node6\.json: stored parameters cannot be read"):
        started(tmp_path / "file" / "node6.json", [])
