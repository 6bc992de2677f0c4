"""What a person does to a live bench beside faults and settings: NMT, SDO, recording, scenarios."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.errors import UserError, brief
from hil_emulator.panel.objects import ObjectsByHand
from hil_emulator.panel.scenario_player import ScenarioPlayer
from hil_emulator.panel.tape import Tape
from hil_emulator.panel.watched import Watched
from hil_emulator.recording.journal import EntryKind, event_entry, frames_of
from hil_emulator.remote.http_server import LoopLine
from hil_emulator.scenario.schema import NMT

Request = Mapping[str, Any]
Answer = dict[str, Any]


class Hands:
    """Acts on a bench; each act answers a request of a page.

    Args:
        told: the briefing by the loop.
        watched: what comes from it.
        line: to it.

    Attributes:
        acts: by what a request wants done; each raises `UserError` for what it refuses.
        scenarios: plays them.

    """

    def __init__(self, told: Mapping[str, Any], watched: Watched, line: LoopLine) -> None:
        self.scenarios = ScenarioPlayer({Path(file).parent for file in told["header"]["files"]})
        self.acts: dict[str, Callable[[Request], Awaitable[Answer]]] = {
            "play": self._play, "nmt": self._nmt, "sdo": self._sdo, "record": self._record,
            "marker": self._marker,
        }  # fmt: skip
        self._header = told["header"]
        self._watched = watched
        self._line = line
        self._objects = ObjectsByHand(self._say, told["eds"])
        self._tape: Tape | None = None
        self._taping = asyncio.Lock()
        watched.listeners.append(self._hear)

    @property
    def status(self) -> Answer:
        """Which recording runs, and how the last scenario goes."""
        tape = self._tape.file.name if self._tape and not self._tape.failed else None
        return {"recording": tape, "scenario": self.scenarios.progress}

    async def close(self) -> None:
        """End what was begun."""
        await self.scenarios.stop()
        async with self._taping:
            await self._stop_tape()

    async def _nmt(self, request: Request) -> Answer:
        command = NMT.get(str(request["command"]))
        if command is None:
            wrong = brief(request["command"])
            raise UserError(f"no NMT command {wrong}; there are {', '.join(NMT)}")
        data = bytes([command, int(request["node"])])
        frames = [[NMT_COB_ID, data.hex()]]
        return await asyncio.to_thread(self._line.ask, {"do": "send", "frames": frames})

    async def _sdo(self, request: Request) -> Answer:
        answer = await self._objects.access(request)
        if "value" in request:  # it may have changed what a PDO means
            learnt = await asyncio.to_thread(self._line.ask, {"do": "messages"})
            if "messages" in learnt:
                self._watched.traffic.learn(learnt["messages"])
        return answer

    async def _record(self, request: Request) -> Answer:
        """Begin a recording, or end that which runs."""
        async with self._taping:
            failed = self._tape is not None and self._tape.failed
            if self._tape is not None:
                await self._stop_tape()
                if not failed:  # otherwise the page shows that none runs
                    return {}
            if request.get("file"):
                file = Path(str(request["file"]))
                self._tape = await asyncio.to_thread(Tape, file, self._header)
                self._watched.listeners.append(self._tape.take)
        return {}

    async def _stop_tape(self) -> None:
        tape, self._tape = self._tape, None
        if tape is not None:
            self._watched.listeners.remove(tape.take)
            await asyncio.to_thread(tape.close)

    async def _play(self, request: Request) -> Answer:
        """Play a scenario, or end that which is played."""
        if request.get("name"):
            await self.scenarios.start(str(request["name"]))
        else:
            await self.scenarios.stop()
        return {}

    async def _marker(self, request: Request) -> Answer:
        """Put a word at this moment into the strips, and into the recording that runs."""
        what = {"marker": brief(str(request.get("text") or "marker"))}
        self._watched.take(event_entry(round(self._watched.now * 1e9), what))
        return {}

    def _say(self, can_id: int, data: bytes) -> None:
        self._line.ask({"do": "send", "frames": [[can_id, data.hex()]]})

    def _hear(self, kind: int, payload: bytes) -> None:
        if kind == EntryKind.BUS:
            self._objects.hear(frames_of(payload))
