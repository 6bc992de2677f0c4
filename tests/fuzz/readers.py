"""Everything that reads a file of somebody else's, by kind."""

import base64
import functools
import sys
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.bus import frame_log
from hil_emulator.captures import by_database, by_dictionary
from hil_emulator.commands import hide, past_times, replay
from hil_emulator.config import course_points
from hil_emulator.config.machine import load_machine
from hil_emulator.config.plant import FmuSettings, Lead
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.errors import UserError
from hil_emulator.fmi.importing.wiring import wire
from hil_emulator.identify.experiment_design import sealed
from hil_emulator.panel import offline_source
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal, streaming
from hil_emulator.recording.messages import from_json
from hil_emulator.scenario import loading
from hil_emulator.scenario.profile import read_profile
from hil_emulator.scenario.schema import SignalProfile
from hil_emulator.simulation.parameter_store import ParameterFile
from tests.fuzz import machine_code

sys.path.append(str(Path(__file__).parents[1]))

from rigs import reference

SHEET = shipped("eds/hydraulic_actuator.eds")


@dataclass(frozen=True)
class Reader:
    """A reader.

    Attributes:
        name: of the kind of file.
        read: raises `UserError` or nothing, whatever the file holds.
        share: weight of its files among all.
        ending: of the file; the name without one.

    """

    name: str
    read: Callable[[Path], object]
    share: float
    ending: str = ""


@functools.cache
def _config() -> Any:
    return reference()


@functools.cache
def _dictionary() -> Dictionary:
    return Dictionary.from_eds(SHEET, 5)


def _recording(file: Path) -> None:
    kept = journal.read(file)
    from_json(kept.header["messages"])
    list(streaming.batches(file))
    replay._check_replayable(file, kept)


def _log(file: Path) -> None:
    experiments([file], _config(), Meaning(headings=()))


def _on_panel(path: Path) -> None:
    source = offline_source.opened(path)
    for watched in source.logs.values():
        watched.row(0.1)


def _capture(file: Path) -> None:
    list(frame_log.captured(file))
    _log(file)


def _database(file: Path) -> None:
    by_database.from_file(file, {})
    experiments([file.parent / "blf" / "run.blf"], _config(), Meaning(databases=[file]))


def _sheet(file: Path) -> None:
    by_dictionary.from_files([file], [5])


def _parameters(file: Path) -> None:
    ParameterFile(file, _dictionary(), lambda text: None).load()


def _profile(file: Path) -> None:
    profile = SignalProfile(signal="external_force", file=file.name)
    read_profile(file.parent, profile)


def _stimulus(file: Path) -> None:
    plant = dict(_config().plant)
    hide._stimulus(file, SimpleNamespace(model=SimpleNamespace(plant_values=plant)))


def packed(truth: bytes) -> bytes:
    """Return the truth of a practice ground as its file holds it."""
    return sealed._HEAD.encode() + base64.b64encode(zlib.compress(truth)) + b"\n"


def _sealed(file: Path) -> None:
    folder, content = file.parent / "sealed", file.read_bytes()
    folder.mkdir(exist_ok=True)
    (folder / sealed.NAME).write_bytes(content if content.startswith(b"#") else packed(content))
    sealed.compared(sealed.unseal(folder), {"effects": []})


def _times(file: Path) -> None:
    past_times.cache_folder = lambda: file.parent
    past_times.recall("run")


def _found(file: Path, name: str) -> None:
    """Open the folder of an identification in which one file has been exchanged."""
    folder = file.parent / "found"
    kept = (folder / name).read_bytes()
    try:
        (folder / name).write_bytes(file.read_bytes())
        _on_panel(folder)
    finally:
        (folder / name).write_bytes(kept)


def _fmu(file: Path) -> None:
    inputs = {"valve_current": Lead("motor.i", "")}
    wire(FmuSettings(file, inputs, {"position": Lead("x[1]", "")}, {"m": 2.0}, 1.0))


READERS = (
    Reader("rec", _recording, 0.16),
    Reader("rec on the panel", _on_panel, 0.01, "rec"),
    Reader("rec to identify", _log, 0.02, "rec"),
    Reader("toml", lambda file: load_machine([file]), 0.03),
    Reader("scenario", loading.load, 0.08, "toml"),
    Reader("eds", lambda file: Dictionary.from_eds(file, 5), 0.02),
    Reader("dcf", _sheet, 0.01),
    Reader("dbc", _database, 0.03),
    Reader("kcd", _database, 0.02),
    Reader("sym", _database, 0.02),
    Reader("csv", _log, 0.07),
    Reader("npz", _log, 0.07),
    Reader("parquet", _log, 0.05),
    Reader("mf4", _log, 0.01),
    Reader("txt", _log, 0.05),
    Reader("lvm", _log, 0.04),
    Reader("tdms", _log, 0.04),
    Reader("xlsx", _log, 0.02),
    Reader("mat", _log, 0.02),
    Reader("blf", _capture, 0.03),
    Reader("asc", _capture, 0.03),
    Reader("log", _capture, 0.03),
    Reader("json", _parameters, 0.03),
    Reader("profile", _profile, 0.02, "csv"),
    Reader("course", lambda file: course_points.column(file, ""), 0.02, "csv"),
    Reader("stimulus", _stimulus, 0.02, "csv"),
    Reader("sealed", _sealed, 0.02),
    Reader("times.json", _times, 0.02, "json"),
    Reader("result.json", lambda file: _found(file, "result.json"), 0.05),
    Reader("traces.npz", lambda file: _found(file, "traces.npz"), 0.05),
    Reader("fmu", _fmu, 0.02),
    Reader("nbi", machine_code.read, 0.005),
    Reader("nbc", machine_code.read, 0.005),
)


def attempt(reader: Reader, file: Path) -> bool:
    """Return whether a file is read; False where it is refused as it should be."""
    try:
        reader.read(file)
    except UserError:
        return False
    return True
