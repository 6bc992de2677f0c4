"""What a person does to a live bench beside faults and settings: NMT, SDO, recording, scenarios."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.errors import UserError, brief
from hil_emulator.panel.live_state import LiveState
from hil_emulator.panel.objects import ObjectsByHand
from hil_emulator.panel.recorder import PanelRecorder
from hil_emulator.panel.scenario_player import ScenarioPlayer
from hil_emulator.recording.journal import EntryKind, event_entry, frames_of
from hil_emulator.remote.http_server import LoopLine
from hil_emulator.scenario.schema import NMT

Request = Mapping[str, Any]
Answer = dict[str, Any]


class OperatorCommands:
    """Acts on a bench; each act answers a request of a page.

    Args:
        told: the briefing by the loop.
        state: what comes from it.
        line: to it.

    Attributes:
        acts: by what a request wants done; each raises `UserError` for what it refuses.
        scenarios: plays them.

    """

    def __init__(self, told: Mapping[str, Any], state: LiveState, line: LoopLine) -> None:
        self.scenarios = ScenarioPlayer({Path(file).parent for file in told["header"]["files"]})
        self.acts: dict[str, Callable[[Request], Awaitable[Answer]]] = {
            "play": self._play, "nmt": self._nmt, "sdo": self._sdo, "record": self._record,
            "marker": self._marker,
        }  # fmt: skip
        self._header = told["header"]
        self._state = state
        self._line = line
        self._objects = ObjectsByHand(self._say, told["eds"])
        self._recorder: PanelRecorder | None = None
        self._changing = asyncio.Lock()
        state.listeners.append(self._hear)

    @property
    def status(self) -> Answer:
        """Which recording runs, and how the last scenario goes."""
        recorder = self._recorder.file.name if self._recorder else None
        return {"recording": recorder, "scenario": self.scenarios.progress}

    async def close(self) -> None:
        """End what was begun."""
        await self.scenarios.stop()
        async with self._changing:
            await self._stop_recorder()

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
                self._state.traffic.learn(learnt["messages"])
        return answer

    async def _record(self, request: Request) -> Answer:
        """Begin a recording, or end that which runs."""
        async with self._changing:
            if self._recorder is not None:
                await self._stop_recorder()
            elif request.get("file"):
                file = Path(str(request["file"]))
                self._recorder = await asyncio.to_thread(PanelRecorder, file, self._header)
                self._state.listeners.append(self._recorder.take)
        return {}

    async def _stop_recorder(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            self._state.listeners.remove(recorder.take)
            await asyncio.to_thread(recorder.close)

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
        self._state.take(event_entry(round(self._state.now * 1e9), what))
        return {}

    def _say(self, can_id: int, data: bytes) -> None:
        self._line.ask({"do": "send", "frames": [[can_id, data.hex()]]})

    def _hear(self, kind: int, payload: bytes) -> None:
        if kind == EntryKind.BUS:
            self._objects.hear(frames_of(payload))
