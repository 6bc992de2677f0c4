"""A bench that lives: reads what its loop writes into shared memory, and asks it for the rest."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.errors import UserError, brief
from hil_emulator.panel import briefing
from hil_emulator.panel.objects import ObjectsByHand
from hil_emulator.panel.ring import RingReader
from hil_emulator.panel.scenario_player import ScenarioPlayer
from hil_emulator.panel.source import FRAMES_PER_S
from hil_emulator.panel.tape import Tape
from hil_emulator.panel.watched import Watched
from hil_emulator.recording.journal import EntryKind, event_entry, frames_of
from hil_emulator.remote.http_server import LoopLine
from hil_emulator.scenario.schema import NMT

Act = Callable[[Mapping[str, Any]], Awaitable[dict[str, Any]]]

_LOOKS_PER_S = 5
LOOP = {"fault", "end", "set"}
"""What is done by the loop as the remote control does it."""


class LiveBench:
    """The bench of one running emulator.

    Args:
        told: the briefing by the loop.
        ring: what the loop writes.
        line: to the loop.

    Attributes:
        watched, logs, hello, stamp_ns, status, ended: see `source.Source`.

    """

    def __init__(self, told: Mapping[str, Any], ring: RingReader, line: LoopLine) -> None:
        header = told["header"]
        self.watched = Watched(header, told["columns"], told["bit_rate"])
        self.view_only = bool(told["view_only"])
        self.hello = {
            "mode": "view" if self.view_only else "live",
            "title": " + ".join(Path(file).stem for file in header["files"]),
            "provenance": header["provenance"],
            "tick": header["tick_ns"] * 1e-9,
            "columns": briefing.units(told["columns"]),
            "machine": told["machine"],
            "bit_rate": told["bit_rate"],
            "settings": briefing.settings(told["machine"]),
            "faults": briefing.faults(),
        }
        self.logs: dict[str, Watched] = {}
        self.stamp_ns = 0
        self.status: dict[str, Any] = {}
        self.ended = asyncio.Event()
        self._ring = ring
        self._line = line
        self._fresh = asyncio.Event()
        self._header = header
        self._tape: Tape | None = None
        self._scenarios = ScenarioPlayer({Path(file).parent for file in header["files"]})
        self.hello["scenarios"] = list(self._scenarios.files)
        self._objects = ObjectsByHand(self._say, told["eds"])
        self.watched.listeners.append(self._hear)
        self._acts: dict[str, Act] = {
            "play": self._play,
            "nmt": self._nmt, "sdo": self._sdo, "record": self._record, "marker": self._marker,
        }  # fmt: skip

    async def next_frame(self) -> None:
        """Return when there is something new to show."""
        await self._fresh.wait()

    async def pump(self) -> None:
        """Take what the loop writes, until it has ended."""
        clock = asyncio.get_running_loop()
        due = clock.time()
        while not self.ended.is_set():
            self.watched.take(self._ring.read())
            self.stamp_ns = self._ring.stamp_ns
            waiting, self._fresh = self._fresh, asyncio.Event()
            waiting.set()
            due = max(due + 1.0 / FRAMES_PER_S, clock.time())
            await asyncio.sleep(due - clock.time())
        self._fresh.set()

    async def look(self) -> None:
        """Ask the loop how it is, again and again."""
        while not self.ended.is_set():
            tape = self._tape.file.name if self._tape else None
            own = {"recording": tape, "scenario": self._scenarios.progress}
            self.status = own | await self._of_loop({"do": "look"})
            await asyncio.sleep(1.0 / _LOOKS_PER_S)

    async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Do what a page asks for."""
        if self.view_only:
            return {"error": "this panel only shows: it was started with --panel-view-only"}
        do = request.get("do")
        if do in LOOP:
            given = {k: v for k, v in request.items() if k not in ("do", "id")}
            return await self._of_loop(
                {"do": do, **given} if do == "end" else {"do": do, str(do): given}
            )
        act = self._acts.get(str(do))
        if act is None:
            return {"error": f"cannot do {brief(do)}"}
        try:
            return await act(request)
        except UserError as error:
            return {"error": str(error)}

    async def _nmt(self, request: Mapping[str, Any]) -> dict[str, Any]:
        command = NMT.get(str(request["command"]))
        if command is None:
            raise UserError(
                f"no NMT command {brief(request['command'])}; there are {', '.join(NMT)}"
            )
        data = bytes([command, int(request["node"])])
        return await self._of_loop({"do": "send", "frames": [[NMT_COB_ID, data.hex()]]})

    async def _sdo(self, request: Mapping[str, Any]) -> dict[str, Any]:
        answer = await self._objects.access(request)
        if "value" in request:  # it may have changed what a PDO means
            self._learn(await self._of_loop({"do": "messages"}))
        return answer

    async def _record(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Begin a recording, or end that which runs."""
        if self._tape is not None:
            await self.stop_tape()
        elif request.get("file"):
            file = Path(str(request["file"]))
            self._tape = await asyncio.to_thread(Tape, file, self._header)
            self.watched.listeners.append(self._tape.take)
        return {}

    async def close(self) -> None:
        """End what was begun by hand."""
        await self._scenarios.stop()
        await self.stop_tape()

    async def stop_tape(self) -> None:
        """End the recording that runs, if one does."""
        tape, self._tape = self._tape, None
        if tape is not None:
            self.watched.listeners.remove(tape.take)
            await asyncio.to_thread(tape.close)

    async def _play(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Play a scenario, or end that which is played."""
        if request.get("name"):
            await self._scenarios.start(str(request["name"]))
        else:
            await self._scenarios.stop()
        return {}

    async def _marker(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Put a word at this moment into the strips, and into the recording that runs."""
        what = {"marker": brief(str(request.get("text") or "marker"))}
        self.watched.take(event_entry(round(self.watched.now * 1e9), what))
        return {}

    def _learn(self, answer: Mapping[str, Any]) -> None:
        if "messages" in answer:
            self.watched.traffic.learn(answer["messages"])

    def _say(self, can_id: int, data: bytes) -> None:
        self._line.ask({"do": "send", "frames": [[can_id, data.hex()]]})

    def _hear(self, kind: int, payload: bytes) -> None:
        if kind == EntryKind.BUS:
            self._objects.hear(frames_of(payload))

    async def _of_loop(self, request: dict[str, Any]) -> dict[str, Any]:
        return await asyncio.to_thread(self._line.ask, request)
