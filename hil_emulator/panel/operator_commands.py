"""Commands of an operator except faults and settings: `protocol.operation`."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.panel.live_state import LiveState
from hil_emulator.panel.objects import ObjectsByHand
from hil_emulator.panel.recorder import PanelRecorder
from hil_emulator.panel.scenario_player import ScenarioPlayer
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.protocol.line import FrameToSend, MessagesRequest, SendRequest
from hil_emulator.protocol.operation import (
    LONGEST_OBJECT,
    MarkerRequest,
    NmtRequest,
    PlayRequest,
    RecordRequest,
    SdoAnswer,
    SdoRequest,
)
from hil_emulator.recording.journal import EntryKind, event_entry, frames_of
from hil_emulator.remote.loop_line import LoopLine
from hil_emulator.scenario.names import NMT


class OperatorCommands:
    """Handles the operator's commands.

    Args:
        info: first message of `server_process`.
        state: of the bench.
        line: to the loop.

    Attributes:
        acts: by request, the function that answers it; each raises `UserError` to refuse.
        scenarios: plays them.

    """

    def __init__(self, info: Mapping[str, Any], state: LiveState, line: LoopLine) -> None:
        self.scenarios = ScenarioPlayer({Path(file).parent for file in info["header"]["files"]})
        self.acts: dict[type[Request], Callable[[Any], Awaitable[Answer]]] = {
            PlayRequest: self._play,
            NmtRequest: self._nmt,
            SdoRequest: self._sdo,
            RecordRequest: self._record,
            MarkerRequest: self._marker,
        }
        self._header = info["header"]
        self._state = state
        self._line = line
        self._objects = ObjectsByHand(self._send_frame, info["eds"])
        self._recorder: PanelRecorder | None = None
        self._changing = asyncio.Lock()
        state.listeners.append(self._hear)

    @property
    def status(self) -> dict[str, Any]:
        """The present recording, and the state of the last scenario."""
        recorder = self._recorder
        name = recorder.file.name if recorder and not recorder.failed else None
        return {"recording": name, "scenario": self.scenarios.progress}

    async def close(self) -> None:
        """End recording and scenario."""
        await self.scenarios.stop()
        async with self._changing:
            await self._stop_recorder()

    async def _nmt(self, request: NmtRequest) -> Answer:
        data = bytes([NMT[request.command], request.node])
        return await asyncio.to_thread(self._line.ask, _send(NMT_COB_ID, data))

    async def _sdo(self, request: SdoRequest) -> Answer:
        text = await self._objects.access(request)
        if request.value is not None:  # it may have changed what a PDO means
            answer = await asyncio.to_thread(self._line.ask, MessagesRequest())
            self._state.traffic.learn(answer.fields()["messages"])
        return SdoAnswer(text=text[:LONGEST_OBJECT])

    async def _record(self, request: RecordRequest) -> Answer:
        """Begin a recording, or end the present one."""
        async with self._changing:
            failed = self._recorder is not None and self._recorder.failed
            if self._recorder is not None:
                await self._stop_recorder()
                if not failed:  # otherwise the page shows that there is no recording
                    return Answer()
            if request.file:
                file = Path(request.file)
                self._recorder = await asyncio.to_thread(PanelRecorder, file, self._header)
                self._state.listeners.append(self._recorder.take)
        return Answer()

    async def _stop_recorder(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            self._state.listeners.remove(recorder.take)
            await asyncio.to_thread(recorder.close)

    async def _play(self, request: PlayRequest) -> Answer:
        """Play a scenario, or end the present one."""
        if request.name:
            await self.scenarios.start(request.name)
        else:
            await self.scenarios.stop()
        return Answer()

    async def _marker(self, request: MarkerRequest) -> Answer:
        """Put a text at this time into the strips, and into the present recording."""
        what = {"marker": request.text}
        self._state.take(event_entry(round(self._state.now * 1e9), what))
        return Answer()

    def _send_frame(self, can_id: int, data: bytes) -> None:
        self._line.ask(_send(can_id, data))

    def _hear(self, kind: int, payload: bytes) -> None:
        if kind == EntryKind.BUS:
            self._objects.hear(frames_of(payload))


def _send(can_id: int, data: bytes) -> SendRequest:
    return SendRequest(frames=[FrameToSend(can_id=can_id, data=data.hex())])
