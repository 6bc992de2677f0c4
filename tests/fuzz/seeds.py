"""Sound files of every kind, to begin with."""

import json
import zipfile
from collections.abc import Iterable
from pathlib import Path

import cantools
import numpy as np

from hil_emulator.platform.paths import shipped
from hil_emulator.recording import exports, journal
from hil_emulator.recording.header import header, remembered
from hil_emulator.simulation.parameter_store import ParameterFile
from tests.fuzz import machine_code
from tests.fuzz.foreign_logs import foreign_logs
from tests.fuzz.readers import SHEET, packed

from rigs import START, bench, reference, set_point  # isort: skip - `readers` makes its folder known

CONFIGS = shipped("configs/hyq_knee.toml").parent
_COURSE = b"time,force\n0.0,0.0\n0.5,100.0\n1.0,-20.0\n"
_STIMULUS = b"time [s],position [m]\n0.0,0.04\n0.5,0.05\n1.0,0.03\n"


def seeds(folder: Path, kinds: Iterable[str]) -> dict[str, list[bytes]]:
    """Return sound files by kind; `folder` is for making them, and keeps what readers need."""
    _run(folder)
    files = dict(foreign_logs())
    for ending in ("csv", "npz", "parquet", "mf4", "blf", "asc", "log"):
        (folder / ending).mkdir()  # captures bring a database along
        exports.export(folder / "run.rec", folder / ending / f"run.{ending}")
        files[ending] = [(folder / ending / f"run.{ending}").read_bytes()]
    recorded = [(folder / "run.rec").read_bytes()]
    sheets = {file.stem: file.read_bytes() for file in sorted(SHEET.parent.glob("*.eds"))}
    # what an I/O module reads is stated by a configuration: its sheet alone decodes no capture
    decoding = [text for name, text in sheets.items() if name != "io_module"]
    times = b'{"run knee.toml:100": [1.5, 30.0], "plot": [1, null]}'
    files |= _databases(folder / "blf" / "run.dbc") | _result(folder / "found") | {
        "rec": recorded, "rec on the panel": recorded, "rec to identify": recorded,
        "toml": [(CONFIGS / f"hyq_{name}.toml").read_bytes() for name in ("knee", "leg")],
        "scenario": [f.read_bytes() for f in sorted((CONFIGS / "scenarios").glob("*.toml"))],
        "eds": [*sheets.values()], "dcf": decoding, "json": [(folder / "p.json").read_bytes()],
        "profile": [_COURSE], "course": [_COURSE], "stimulus": [_STIMULUS],
        "sealed": _sealed(), "times.json": [times],
        "fmu": [_fmu(folder / "crane.fmu")],
    }  # fmt: skip
    wanted = set(kinds)
    return files | (machine_code.kept(folder) if wanted & {"nbi", "nbc"} else {})


def _run(folder: Path) -> None:
    """Record a fraction of a second with a fault and a setting, and store parameters."""
    config = reference()
    with bench(config) as b:
        b.rig.fault("supply", "droop", start="5 ms", duration="5 ms")
        b.ticks(40, START, set_point(1.0))
        b.ticks(40, set_point(-1.0))
        b.rig.set("external_force", 10.0)
        b.tick()
        journal.write(remembered(b.recorder, header(config, b.rig.nodes)), folder / "run.rec")
        store = ParameterFile(folder / "p.json", b.rig.nodes[0].dictionary, lambda text: None)
        store.save({(0x1017, 0): b"\x01\x00", (0x2000, 0): bytes(4)})


def _databases(file: Path) -> dict[str, list[bytes]]:
    database = cantools.database.load_file(file)
    return {
        "dbc": [file.read_bytes()],
        "kcd": [database.as_kcd_string().encode()],
        "sym": [database.as_sym_string().encode()],
    }


def _result(folder: Path) -> dict[str, list[bytes]]:
    """Write what `identify --out` does: two logs of one channel."""
    folder.mkdir()
    time, measured = np.arange(50) * 0.01, np.linspace(0.0, 1.0, 50)
    parts = dict.fromkeys(("measured", "before", "after", "free_before", "free_after"), measured)
    parts |= {"time": time, "noise": np.ones(1)}
    logs = {f"{log}/load_force|{p}": v for log in ("a.csv", "b.csv") for p, v in parts.items()}
    np.savez(folder / "traces.npz", **logs)
    effect = {"name": "gravity", "value": 5.0, "interval": [1.0, 9.0], "group": ["mass"]}
    result = {
        "verdict": "agrees",
        "reason": "all agree",
        "effects": [effect],
        "gap_measure": "N",
    }
    result["gap"] = {"load_force": {"training": {"before": 1.0, "after": None}}}
    (folder / "result.json").write_text(json.dumps(result))
    return {name: [(folder / name).read_bytes()] for name in ("result.json", "traces.npz")}


def _sealed() -> list[bytes]:
    """Return the truth of a practice ground, in the open and as it is kept."""
    effect = {"name": "gravity", "knob": "acceleration", "value": 5.0, "unit": "m/s^2"}
    truth = {"configuration": "abc", "seed": 1, "ordinary": {"mass": 0.5}, "effects": [effect]}
    plain = json.dumps(truth).encode()
    return [plain, packed(plain)]


def _fmu(file: Path) -> bytes:
    description = (Path(__file__).parents[1] / "fmi" / "crane.xml").read_text()
    with zipfile.ZipFile(file, "w") as out:
        out.writestr("modelDescription.xml", description)
        for system in ("linux64", "win64", "darwin64"):
            out.writestr(f"binaries/{system}/crane.so", b"\x7fELF")
    return file.read_bytes()
