"""Everything that reads a file of somebody else's, each with sound files to begin with."""

import functools
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.bus import frame_log
from hil_emulator.captures import by_database, by_dictionary
from hil_emulator.commands import replay
from hil_emulator.config.machine import load_machine
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.errors import UserError
from hil_emulator.identify.measured import reading
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import exports, journal, streaming
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.messages import from_json
from hil_emulator.scenario import perform, schema
from hil_emulator.simulation.parameter_store import ParameterFile
from tests.fuzz.foreign_logs import foreign_logs

sys.path.append(str(Path(__file__).parents[1]))

from rigs import START, bench, reference

KNEE = shipped("configs/hyq_knee.toml")
SHEET = shipped("eds/hydraulic_actuator.eds")


@dataclass(frozen=True)
class Reader:
    """A reader.

    Attributes:
        name: of the format.
        read: raises `UserError` or nothing, whatever the file holds.
        share: weight of its files among all.

    """

    name: str
    read: Callable[[Path], object]
    share: float


def _recording(file: Path) -> None:
    kept = journal.read(file)
    from_json(kept.header["messages"])
    list(streaming.batches(file))
    replay._check_replayable(file, kept)


@functools.cache
def _dictionary() -> Dictionary:
    return Dictionary.from_eds(SHEET, 5)


def _parameters(file: Path) -> None:
    ParameterFile(file, _dictionary(), lambda text: None).load()


def _database(file: Path) -> None:
    by_database.from_file(file, {})


def _profile(file: Path) -> None:
    profile = schema.SignalProfile(signal="external_force", file=file.name)
    perform._profile(file.parent, profile)


READERS = (
    Reader("rec", _recording, 0.32),
    Reader("toml", lambda file: load_machine([file]), 0.01),
    Reader("scenario", schema.load, 0.17),
    Reader("eds", lambda file: Dictionary.from_eds(file, 5), 0.01),
    Reader("dcf", lambda file: by_dictionary.from_files([file], [5]), 0.01),
    Reader("dbc", _database, 0.05),
    Reader("csv", reading.read, 0.08),
    Reader("npz", reading.read, 0.08),
    Reader("parquet", reading.read, 0.06),
    Reader("mf4", reading.read, 0.002),
    Reader("txt", reading.read, 0.03),
    Reader("lvm", reading.read, 0.02),
    Reader("tdms", reading.read, 0.02),
    Reader("xlsx", reading.read, 0.01),
    Reader("mat", reading.read, 0.003),
    Reader("blf", lambda file: list(frame_log.captured(file)), 0.04),
    Reader("asc", lambda file: list(frame_log.captured(file)), 0.04),
    Reader("log", lambda file: list(frame_log.captured(file)), 0.04),
    Reader("json", _parameters, 0.03),
    Reader("profile", _profile, 0.02),
)


def attempt(reader: Reader, file: Path) -> bool:
    """Tell whether a file is read; False where it is refused as it should be."""
    try:
        reader.read(file)
    except UserError:
        return False
    return True


def seeds(folder: Path) -> dict[str, list[bytes]]:
    """Return sound files by the name of their reader; `folder` is for making them."""
    config = reference()
    with bench(config) as b:
        b.rig.fault("supply", "droop", start="5 ms", duration="5 ms")
        for _ in range(30):
            b.tick(START)
        b.rig.set("external_force", 10.0)
        b.tick()
        journal.write(remembered(b.recorder, header(config, b.rig.nodes)), folder / "run.rec")
        store = ParameterFile(folder / "p.json", b.rig.nodes[0].dictionary, lambda text: None)
        store.save({(0x1017, 0): b"\x01\x00", (0x2000, 0): bytes(4)})
    found = {}
    for ending in ("csv", "npz", "parquet", "mf4", "blf", "asc", "log"):
        exports.export(folder / "run.rec", folder / f"run.{ending}", overwrite=True)
        found[ending] = [(folder / f"run.{ending}").read_bytes()]
    sheets = [file.read_bytes() for file in sorted(SHEET.parent.glob("*.eds"))]
    configs = KNEE.parent
    machine = (configs / "hyq_leg.toml").read_bytes()
    return (
        foreign_logs()
        | found
        | {
            "rec": [(folder / "run.rec").read_bytes()],
            "toml": [KNEE.read_bytes(), (configs / "hyq_knee_separate.toml").read_bytes(), machine],
            "scenario": [f.read_bytes() for f in sorted((configs / "scenarios").glob("*.toml"))],
            "eds": sheets,
            "dcf": sheets,
            "dbc": [next(folder.glob("*.dbc")).read_bytes()],
            "json": [(folder / "p.json").read_bytes()],
            "profile": [b"time,force\n0.0,0.0\n0.5,100.0\n1.0,-20.0\n"],
        }
    )
