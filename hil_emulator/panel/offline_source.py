"""A recording or the result of an identification on the panel's page."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.config.bus import FASTEST
from hil_emulator.config.load import Configuration, load_texts
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import UNITS
from hil_emulator.panel import session_info
from hil_emulator.panel.live_state import LiveState, of_recording
from hil_emulator.panel.result_folder import MODELS, RESULT, TRACES, Trace, result_of, traces_of
from hil_emulator.panel.source import FRAMES_PER_S
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.recording import SUFFIX, journal


class OfflineSource:
    """A recording or an identification, without new data and without changes.

    Args:
        logs: the logs by name; the first one is shown.
        hello: further fields of the first message.

    Attributes:
        logs, state, hello, stamp_ns, status, ended: see `source.Source`.

    """

    def __init__(self, logs: Mapping[str, LiveState], hello: Mapping[str, Any]) -> None:
        self.logs = dict(logs)
        self.state = next(iter(logs.values()))
        messages = {name: _first_message(state) for name, state in logs.items()}
        self.hello = {"logs": messages, **hello}
        self.stamp_ns = 0
        self.status: dict[str, Any] = {}
        self.ended = asyncio.Event()

    async def next_frame(self) -> None:
        """Return after a while."""
        await asyncio.sleep(1.0 / FRAMES_PER_S)

    async def ask(self, request: Request) -> Answer:
        """Refuse every request."""
        raise UserError("a recording or result cannot be changed")


def opened(path: Path) -> OfflineSource:
    """Return a recording, or the folder of an identification.

    Raises:
        UserError: if it is neither, or cannot be read.

    """
    if path.is_dir():
        return _identification(path)
    if path.suffix != SUFFIX:
        raise UserError(f"{path}: name a recording (.rec), or the folder of identify --out")
    recording = journal.read(path)
    if not len(recording.rows):
        raise UserError(f"{path}: no tick was recorded")
    config = _configuration(recording.header)
    bit_rate = config.wire.assumed_bit_rate if config else FASTEST
    return OfflineSource(
        {path.name: of_recording(recording, bit_rate)},
        {
            "mode": "recorded",
            "title": path.name,
            "provenance": recording.provenance,
            "tick": recording.header["tick_ns"] * 1e-9,
            "machine": session_info.machine(config) if config else None,
            "bit_rate": bit_rate,
        },
    )


def _first_message(state: LiveState) -> dict[str, Any]:
    history = state.history
    span = [history.begin * history.tick, history.end * history.tick]
    return {"columns": session_info.units(state.columns), "span": span}


def _configuration(header: Mapping[str, Any]) -> Configuration | None:
    """Return the configuration of a recording without running its effect files."""

    def refuse(file: Path, content: bytes) -> None:
        raise UserError(f"{file}: a picture runs no code")

    try:
        return load_texts([Path(f) for f in header["files"]], header["configuration"], refuse)
    except (UserError, KeyError):
        return None


def _identification(folder: Path) -> OfflineSource:
    result, traces = result_of(folder / RESULT), traces_of(folder / TRACES)
    logs = {log: _state(traces[log]) for log in sorted(traces)}
    if not logs:
        raise UserError(f"{folder}: its identification has no measured channel")
    return OfflineSource(
        logs,
        {
            "mode": "found",
            "title": folder.name,
            "provenance": {},
            "tick": next(iter(logs.values())).history.tick,
            "machine": None,
            "bit_rate": FASTEST,
            "result": {name: result[name] for name in ("verdict", "reason", "effects", "gap")}
            | {"measure": result["gap_measure"]},
        },
    )


def _state(channels: Mapping[str, Trace]) -> LiveState:
    """Return a log with the measurement and both models, by channel."""
    time = next(iter(channels.values()))["time"]
    table = {"time": time}
    for channel, trace in sorted(channels.items()):
        table[channel] = trace["measured"]
        for word, part in MODELS.items():
            free = trace[f"free_{part}"]
            error = free if np.isfinite(free).any() else trace[part]
            table[f"{channel}.{word}"] = trace["measured"] - error
    header = {"tick_ns": round(float(time[1] - time[0]) * 1e9), "messages": []}
    units = {name: UNITS.get(name.partition(".")[0], "1") for name in table} | {"time": "s"}
    state = LiveState(header, units, FASTEST, len(time))
    state.history.append(np.column_stack(list(table.values())))
    return state
