"""A running bench: reads the loop's shared memory, and sends requests to the loop."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.panel import session_info
from hil_emulator.panel.live_state import LiveState
from hil_emulator.panel.operator_commands import OperatorCommands
from hil_emulator.panel.ring import RingReader
from hil_emulator.panel.source import FRAMES_PER_S
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.protocol.dispatch import answering
from hil_emulator.protocol.offered import READING
from hil_emulator.protocol.rig import StatusRequest
from hil_emulator.remote.loop_line import LoopLine

_LOOKS_PER_S = 5


class LiveBench:
    """The bench of one running emulator.

    Args:
        info: first message of `server_process`.
        ring: written by the loop.
        line: to the loop.

    Attributes:
        state, logs, hello, stamp_ns, status, ended: see `source.Source`.

    """

    def __init__(self, info: Mapping[str, Any], ring: RingReader, line: LoopLine) -> None:
        header = info["header"]
        self.state = LiveState(header, info["columns"], info["bit_rate"])
        self.view_only = bool(info["view_only"])
        self.hello = {
            "mode": "view" if self.view_only else "live",
            "title": " + ".join(Path(file).stem for file in header["files"]),
            "provenance": header["provenance"],
            "tick": header["tick_ns"] * 1e-9,
            "columns": session_info.units(info["columns"]),
            "machine": info["machine"],
            "bit_rate": info["bit_rate"],
            "settings": session_info.settings(info["machine"]),
            "faults": session_info.faults(),
            "nodes": [int(number) for number in info["eds"]],
        }
        self.logs: dict[str, LiveState] = {}
        self.stamp_ns = 0
        self.status: dict[str, Any] = {}
        self.ended = asyncio.Event()
        self._ring = ring
        self._line = line
        self._fresh = asyncio.Event()
        self._commands = OperatorCommands(info, self.state, line)
        self.hello["scenarios"] = list(self._commands.scenarios.files)

    async def next_frame(self) -> None:
        """Return when there are new data."""
        await self._fresh.wait()

    async def pump(self) -> None:
        """Read the loop's data until it has ended."""
        clock = asyncio.get_running_loop()
        due = clock.time()
        while not self.ended.is_set():
            self.state.take(self._ring.read())
            self.stamp_ns = self._ring.stamp_ns
            waiting, self._fresh = self._fresh, asyncio.Event()
            waiting.set()
            due = max(due + 1.0 / FRAMES_PER_S, clock.time())
            await asyncio.sleep(due - clock.time())
        self._fresh.set()

    async def look(self) -> None:
        """Request the loop's status periodically."""
        while not self.ended.is_set():
            with answering() as reply:
                reply.content = (await self._of_loop(StatusRequest())).fields()
            self.status = self._commands.status | dict(reply.content)
            await asyncio.sleep(1.0 / _LOOKS_PER_S)

    async def ask(self, request: Request) -> Answer:
        """Handle a request of a page."""
        if self.view_only and not isinstance(request, READING):
            raise UserError("this panel only shows: it was started with --panel-view-only")
        return await self._commands.acts.get(type(request), self._of_loop)(request)

    async def close(self) -> None:
        """End the operator's recording and scenario."""
        await self._commands.close()

    async def _of_loop(self, request: Request) -> Answer:
        return await asyncio.to_thread(self._line.ask, request)
