"""Recordings are untrusted: damage gives a message, and named code is not executed."""

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rigs import START, bench

from hil_emulator.commands.replay import replay
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal as journals
from hil_emulator.recording.exports import export
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.journal import MAGIC, EntryKind, bus_entry, entry, event_entry
from hil_emulator.recording.messages import from_json
from hil_emulator.recording.streaming import batches

REFERENCE = shipped("configs/hyq_knee.toml")
EFFECT = """
from pathlib import Path

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import friction

Path(__file__).with_name("it_ran").touch()


@effect(friction, knob=Param("strength", "N*s^2/m^2", "drag", 50.0, 0.0, 1e4), source="assumed",
        signature="high speed")
def quadratic(velocity, strength):
    '''F = C v |v|.'''
    return strength * velocity * abs(velocity)


EFFECTS = (quadratic,)
"""


def head(journal: Path) -> dict[str, Any]:
    """Return the header of a recording."""
    return journals.read(journal).header


def written(file: Path, header: object, *entries: bytes) -> Path:
    """Write a journal of one's own making."""
    file.write_bytes(
        MAGIC + entry(EntryKind.HEADER, json.dumps(header).encode()) + b"".join(entries)
    )
    return file


def test_a_journal_of_the_first_version_is_read(journal: Path, tmp_path: Path) -> None:
    """It had messages by name, without objects, and no period of SYNC; its frames keep words."""
    now = head(journal)
    fields = ("name", "start", "bits", "signed", "real", "factor", "unit")
    first = {k: v for k, v in now.items() if k != "sync_ms"} | {
        "messages": [
            {"name": f"{m['pdo']}_{m['node']}", "can_id": m["can_id"], "size": m["size"],
             "fields": [{k: f[k] for k in fields} for f in m["fields"]]}
            for m in now["messages"]
        ]
    }  # fmt: skip
    file = written(tmp_path / "first.rec", first)
    file.write_bytes(file.read_bytes().replace(MAGIC, b"HILREC1\n", 1))
    again = [from_json([m])[0] for m in head(file)["messages"]]
    assert [(m.name, m.can_id) for m in again] == [
        (m.name, m.can_id) for m in from_json(now["messages"])
    ]
    export(file, tmp_path / "first.blf")
    assert (tmp_path / "first.dbc").read_text(encoding="latin-1").count("SG_") > 10


CHANGES: list[Callable[[dict[str, Any]], object]] = [
    lambda h: [],
    lambda h: 5,
    lambda h: {},
    lambda h: h | {"columns": []},
    lambda h: h | {"columns": {"position": "m"}},
    lambda h: h | {"columns": {"time": 1}},
    lambda h: h | {"provenance": {}},
    lambda h: h | {"seed": "one"},
    lambda h: h | {"seed": True},
    lambda h: h | {"tick_ns": 0},
    lambda h: h | {"nodes": [[5]]},
    lambda h: h | {"messages": [{"name": "x"}]},
    lambda h: h | {"messages": [h["messages"][0] | {"fields": [{}]}]},
    lambda h: h | {"files": "run.toml"},
    lambda h: h | {"configuration": [5]},
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_damaged_header_is_one_message(
    journal: Path, tmp_path: Path, change: Callable[[dict[str, Any]], object]
) -> None:
    """Whatever is missing or of another type in it."""
    with pytest.raises(UserError, match="its header is damaged"):
        journals.read(written(tmp_path / "x.rec", change(head(journal))))


@pytest.mark.parametrize(
    "damage",
    [
        entry(EntryKind.ROW, bytes(7)),
        entry(EntryKind.ROW, bytes(8)),
        struct.pack("<BI", 9, 0),
        entry(EntryKind.BUS, bytes(3)),
        entry(EntryKind.BUS, bytes(10)),
        bus_entry(-5, [Frame(0x100)], sent=True),
        bus_entry(5, [Frame(0xFFFF_FFFF)], sent=True),
        entry(EntryKind.EVENT, bytes(3)),
        entry(EntryKind.EVENT, bytes(8) + b"[]"),
        entry(EntryKind.EVENT, bytes(8) + b"[" * 5000),
        entry(EntryKind.HEADER, b"{}"),
    ],
)
def test_a_damaged_entry_is_one_message(journal: Path, tmp_path: Path, damage: bytes) -> None:
    """Unknown, short or invalid entries are reported when rows or frames are read."""
    file = written(tmp_path / "x.rec", head(journal), damage)
    with pytest.raises(UserError, match="damaged before byte"):
        journals.read(file)
    with pytest.raises(UserError, match="damaged before byte"):
        list(batches(file))


def test_an_entry_that_claims_gigabytes_is_the_end_of_the_file(
    journal: Path, tmp_path: Path
) -> None:
    """As after a sudden end of the writer; no memory is taken for it."""
    claim = struct.pack("<BI", EntryKind.ROW, 0xFFFF_FFFF)
    file = written(tmp_path / "x.rec", head(journal), claim + bytes(100))
    assert len(journals.read(file).rows) == 0


@pytest.mark.parametrize(
    "what", [{"end": 7}, {"end": "x"}, {"set": 5}, {"fault": []}, {"serve": "a"}, {}]
)
def test_a_damaged_event_is_one_message(journal: Path, tmp_path: Path, what: Any) -> None:
    """What cannot have been done to a rig cannot be repeated."""
    recording = journals.read(journal)
    row = entry(EntryKind.ROW, recording.rows[0].tobytes())
    file = written(tmp_path / "x.rec", recording.header, event_entry(0, what), row)
    with pytest.raises(UserError, match="is damaged"):
        replay(file, [])


def test_a_trigger_that_never_fired_is_reported_by_both_ends(tmp_path: Path) -> None:
    """`run` reports that nothing was recorded and why, and `replay` that there are no rows."""
    file = tmp_path / "crash.rec"
    options = ["--bus", "virtual:crash", "--clock", "lockstep", "--duration", "20 ms"]
    trigger = ["--record", file, "--trigger", "position > 79 mm"]
    command = [sys.executable, "-m", "hil_emulator", "run", REFERENCE, *options, *trigger]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert 'crash.rec, without a tick: "position > 79 mm" never held' in result.stdout
    with pytest.raises(UserError, match='holds no tick: "position > 79 mm" never held'):
        replay(file, [])


def own_effect(folder: Path) -> Path:
    """Record a machine with an effect of its own; return the recording."""
    (folder / "mine.py").write_text(EFFECT)
    layer = folder / "layer.toml"
    layer.write_text('[model]\neffects = ["mine.py"]\n')  # off: no model has to be compiled for it
    config = load([REFERENCE, layer])
    with bench(config) as b:
        b.ticks(5, START)
        made = remembered(b.recorder, header(config, b.rig.nodes))
    journals.write(made, folder / "run.rec")
    (folder / "it_ran").unlink()
    return folder / "run.rec"


def test_a_recording_carries_its_configuration(journal: Path, tmp_path: Path) -> None:
    """What has become of the files since is of no consequence."""
    config = tmp_path / "machine.toml"
    eds = shipped("eds/hydraulic_actuator.eds")
    config.write_text(REFERENCE.read_text().replace("../eds/hydraulic_actuator.eds", str(eds)))
    with bench(load([config])) as b:
        b.ticks(20, START)
        made = remembered(b.recorder, header(load([config]), b.rig.nodes))
    journals.write(made, tmp_path / "run.rec")
    config.write_text("[supply]\n")
    assert replay(tmp_path / "run.rec", [])
    config.unlink()
    assert replay(tmp_path / "run.rec", [])


def test_the_recorded_effect_file_runs_after_a_line_that_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the digest that it had."""
    assert replay(own_effect(tmp_path), [])
    assert "mine.py, as recorded (sha256 " in capsys.readouterr().out
    assert (tmp_path / "it_ran").exists()


def test_any_other_effect_file_is_not_run(tmp_path: Path) -> None:
    """Not one that has changed by a space, unless the configuration is named by the user."""
    file = own_effect(tmp_path)
    (tmp_path / "mine.py").write_text(EFFECT + " \n")
    with pytest.raises(UserError, match="is not the one that was recorded"):
        replay(file, [])
    assert not (tmp_path / "it_ran").exists()
    assert replay(file, [REFERENCE, tmp_path / "layer.toml"])
    assert (tmp_path / "it_ran").exists()


def test_an_effect_file_beside_the_reader_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Relative names would be looked for wherever the user happens to be."""
    file = own_effect(tmp_path)
    recording = journals.read(file)
    recording.header["files"] = ["hyq_knee.toml", "layer.toml"]
    file.unlink()
    journals.write(recording, file)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match="does not name its configuration"):
        replay(file, [])
    assert not (tmp_path / "it_ran").exists()


def test_compiled_code_beside_an_effect_file_is_not_run(tmp_path: Path) -> None:
    """The digest is that of the text, so the text is what runs."""
    import importlib.util
    import py_compile

    file = own_effect(tmp_path)
    mine = tmp_path / "mine.py"
    evil = tmp_path / "evil.py"
    evil.write_text("raise SystemExit('something else ran')".ljust(mine.stat().st_size))
    cached = Path(importlib.util.cache_from_source(str(mine)))
    cached.parent.mkdir()
    py_compile.compile(str(evil), str(cached))
    code = bytearray(cached.read_bytes())
    code[8:12] = struct.pack("<I", int(mine.stat().st_mtime))
    cached.write_bytes(bytes(code))
    assert replay(file, [])
