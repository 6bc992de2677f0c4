"""`hil-emulator replay`: run the recorded frames of a controller again and compare the response."""

import dataclasses
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from hil_emulator.bus import frame_log, log_endings
from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.effect_files import digest
from hil_emulator.config.load import Configuration, load_rig, load_texts, on_bus
from hil_emulator.config.toml_file import read_text
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.recording import journal
from hil_emulator.recording.header import header, remembered
from hil_emulator.recording.journal import Recording
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.recording.messages import describe, from_json
from hil_emulator.signals.columns import columns
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.rig import Rig

LONGEST_NS = 86_400 * 10**9
"""Longest log that can be replayed: a day [ns] (assumed)."""

_SHOWN = 10  # differing signals that are listed


class Script:
    """A bus that plays recorded frames and discards the emulator's, which the recorder has.

    Args:
        frames: time [ns] and frame of the emulator's recorded input.

    """

    def __init__(self, frames: Iterable[tuple[int, Frame]]) -> None:
        self._frames = {
            now: [f for _, f in group]
            for now, group in itertools.groupby(frames, key=lambda item: item[0])
        }
        self.now_ns = 0

    def receive(self) -> list[Frame]:
        """Return the remaining frames of this tick."""
        return self._frames.pop(self.now_ns, [])

    def take(self, count: int) -> list[Frame]:
        """Return the next frames of this tick: those that were served before it began."""
        frames = self._frames.get(self.now_ns, [])
        taken, frames[:] = frames[:count], frames[count:]
        return taken

    def send(self, frames: Iterable[Frame]) -> None:
        """Discard frames: the recorder has them."""

    def report(self, error_class: int) -> None:
        """Discard an error: there is no other participant."""


@dataclass(frozen=True)
class Repetition:
    """A recording and its repetition.

    Attributes:
        recorded: recorded output of the emulator: time [ns] and frame.
        repeated: output of the repetition.
        deviations: largest difference of each signal that differs, SI.

    """

    recorded: list[tuple[int, Frame]]
    repeated: list[tuple[int, Frame]]
    deviations: dict[str, float]

    @property
    def same(self) -> bool:
        """Whether both agree bit for bit."""
        return self.recorded == self.repeated and not self.deviations

    def first(self) -> int:
        """Return the number of the first frame that differs."""
        pairs = enumerate(itertools.zip_longest(self.recorded, self.repeated))
        return next(i for i, (a, b) in pairs if a != b)


def replay(file: Path, files: Sequence[Path]) -> bool:
    """Replay a recording, print the differences, and return whether both are equal.

    Args:
        file: a journal, or a log of frames in a format of `bus.frame_log`.
        files: configuration files; needed for a log, else those of the recording.

    Raises:
        UserError: if the recording or its configuration cannot be read.

    """
    recording, config = _source(file, files)
    with waiting("replay", [file, *files]):
        result = compare(recording, config)
    click.echo(_verdict(result, recording))
    return result.same


def compare(recording: Recording, config: Configuration) -> Repetition:
    """Return a recording together with its repetition in lock-step."""
    script = Script((now, f) for now, sent, f in recording.frames if not sent)
    recorder = MemoryRecorder()
    rig = assemble(config, script, cache_folder(), recorder)
    last_ns = max([now for now, _, _ in recording.frames], default=0)
    if last_ns > LONGEST_NS:
        raise UserError(f"the log's times reach {last_ns * 1e-9:g} s; replay a part of it")
    ticks = len(recording.rows) or last_ns // config.tick_ns + 1
    events = list(recording.events)
    running: list[Any] = []
    for _ in range(ticks):
        script.now_ns = rig.now_ns
        while events and events[0][0] <= rig.now_ns:
            what = events.pop(0)[1]
            try:
                _repeat(rig, script, what, running)
            except (LookupError, TypeError, AttributeError, ValueError):
                raise UserError(f"the action at {rig.now_ns * 1e-9:.3f} s is damaged") from None
        rig.step()
    repeated = remembered(recorder, recording.header)
    return Repetition(
        [(now, f) for now, sent, f in recording.frames if sent],
        [(now, f) for now, sent, f in repeated.frames if sent],
        _deviations(recording, repeated),
    )


def _repeat(rig: Rig, script: Script, what: dict[str, Any], running: list[Any]) -> None:
    """Apply a recorded action to the rig."""
    if "serve" in what:
        rig.serve(script.take(what["serve"]))
        return
    if "fault" in what:
        options = dict(what["fault"])
        running.append(rig.fault(options.pop("target"), options.pop("kind"), **options))
    elif what.keys() & {"slipped", "bus_load", "marker"}:
        pass  # in lock-step there is no delay; the bus load follows from the frames
    elif "end" in what:
        running[what["end"]].end()
    else:
        for name, value in what["set"].items():
            rig.set(name, value)


def _deviations(recording: Recording, repeated: Recording) -> dict[str, float]:
    if not len(recording.rows):
        return {}
    then, now = recording.rows, repeated.rows
    with np.errstate(invalid="ignore"):
        difference = np.where((then == now) | np.isnan(then) & np.isnan(now), 0.0, then - now)
    largest = np.nan_to_num(np.abs(difference), nan=np.inf).max(axis=0)
    deviations = zip(recording.units, largest.tolist(), strict=True)
    return {name: value for name, value in deviations if value > 0.0}


def _source(file: Path, files: Sequence[Path]) -> tuple[Recording, Configuration]:
    """Return a recording and the configuration to repeat it with."""
    if file.suffix in log_endings.SUFFIXES:
        if not files:
            raise UserError(f"{file}: a log does not contain the configuration; add CONFIG")
        config = load_rig(files)
        frames = list(frame_log.read(file, config.tick_ns))
        if file.suffix == ".log" and frames and not any(sent for _, sent, _ in frames):
            raise UserError(
                f"{file}: does not state which frames the emulator sent; record it with "
                "--record-direction, or as .pcapng, .blf or .asc"
            )
        head = header(config, ())
        return Recording(head, np.empty((0, len(head["columns"]))), frames), config
    recording = journal.read(file)
    _check_replayable(file, recording)
    config = load_rig(files) if files else _recorded(file, recording.header)
    config = _as_recorded(config, recording.header)
    if not files and config.digest != recording.provenance["digest"]:
        raise UserError(
            f"{file}: its configuration has changed since (digest {config.digest}, then "
            f"{recording.provenance['digest']}); name the CONFIG to replay it with"
        )
    return recording, config


def _check_replayable(file: Path, recording: Recording) -> None:
    """Refuse a recording that does not begin with the start of the emulator."""
    trigger = recording.header["capture"]
    if not len(recording.rows):
        reason = f': "{trigger}" never held' if trigger else "; it ended before the first tick"
        raise UserError(f"{file}: holds no tick{reason}")
    if trigger:
        raise UserError(
            f"{file}: begins {recording.rows[0, 0]:g} s after the start, around "
            f'"{trigger}"; only a recording from the start can be replayed'
        )
    if mates := recording.header.get("supply_mates"):
        raise UserError(
            f"{file}: was recorded on a supply shared with {', '.join(mates)}: their flow is not "
            "recorded, so it cannot be replayed alone"
        )
    if recording.units != columns():
        raise UserError(f"{file}: has other columns than this version records; replay it with its")


def _recorded(file: Path, head: dict[str, Any]) -> Configuration:
    """Return the configuration of a recording; that of an older version is read again.

    A recording may come from an untrusted source. An effect file that it names runs only if its
    digest is the recorded one.
    """
    paths = [Path(name) for name in head["files"]]
    if not all(path.is_absolute() for path in paths):
        raise UserError(f"{file}: does not name its configuration; name the CONFIG")
    texts = head.get("configuration") or [read_text(path, "configuration") for path in paths]
    if len(texts) != len(paths):
        raise UserError(f"{file}: its configuration is incomplete; name the CONFIG")

    def admit(path: Path, content: bytes) -> None:
        actual = digest(content)
        if actual not in head.get("effects", {}):
            raise UserError(
                f"{file}: the effect file {path} is not the one that was recorded; it has not been "
                "run. Name the CONFIG to replay it with"
            )
        click.echo(f"runs      {near(path)}, as recorded (sha256 {actual[:16]})")

    return on_bus(load_texts(paths, texts, admit))


def _as_recorded(config: Configuration, head: dict[str, Any]) -> Configuration:
    """Return an actuator's configuration with the values that its machine has set."""
    ids = head.get("nodes", [])
    if len(ids) == len(config.nodes):
        pairs = zip(config.nodes, ids, strict=True)
        nodes = tuple(dataclasses.replace(n, id=i, bus_number=bus) for n, (i, bus) in pairs)
        config = dataclasses.replace(config, nodes=nodes)
    return dataclasses.replace(config, seed=head["seed"])


def _verdict(result: Repetition, recording: Recording) -> str:
    if result.same:
        return f"the same, bit for bit: {len(result.recorded)} frames"
    lines = []
    if result.recorded != result.repeated:
        at = result.first()
        messages = {m.identifier: m for m in from_json(recording.header["messages"])}
        lines.append(f"frame {at + 1} of {len(result.recorded)} differs")
        for name, frames in (("then", result.recorded), ("now", result.repeated)):
            lines.append(f"  {name:<4}  {_line(frames, at, messages)}")
    if result.deviations:
        rows = [
            (name, f"{value:.3g}", recording.units[name])
            for name, value in list(result.deviations.items())[:_SHOWN]
        ]
        lines.append(text_table(("signal", "largest difference", "unit"), rows))
    return "\n".join(lines)


def _line(frames: Sequence[tuple[int, Frame]], at: int, messages: Any) -> str:
    if at >= len(frames):
        return "nothing more"
    now_ns, frame = frames[at]
    return (
        f"{now_ns * 1e-9:.3f} s  {frame.can_id:03X}  {frame.data.hex(' ')}  "
        f"{describe(frame, messages)}"
    )
