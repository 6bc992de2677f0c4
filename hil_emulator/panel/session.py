"""The session of one browser: its view, its requests, its messages."""

import asyncio
import json
import statistics
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.panel.live_state import EXECUTION, LATENESS, LiveState
from hil_emulator.panel.source import FRAMES_PER_S, Source
from hil_emulator.panel.strips import Strips
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.protocol.dispatch import answering, json_object, parsed
from hil_emulator.protocol.offered import OF_PANEL
from hil_emulator.protocol.page import (
    LogRequest,
    PaintedRequest,
    RowAnswer,
    RowRequest,
    ViewRequest,
    WatchRequest,
)

ENDED = 4001
"""Code with which the stream is closed when the emulator has ended (RFC 6455: for private use)."""
PUNCTUAL = (LATENESS, EXECUTION)
"""Signals of the loop's timing, which a recording lacks."""
_TELL_EVERY = FRAMES_PER_S // 5  # frames between two messages in words
_LINES = 200  # of the trace, at a time (assumed)
_AGES = 300  # for the reported median: ten seconds (assumed)
_KEPT = 64  # messages whose way to the screen is timed


class Session:
    """Serves one browser until it leaves, or the bench has ended.

    Args:
        source: the bench.
        connection: to the browser.

    """

    def __init__(self, source: Source, connection: ServerConnection) -> None:
        self._source = source
        self._connection = connection
        self._state = source.state
        self._strips = Strips(source.state.history)
        self._watching = ""
        self._wanted, self._after = "", 0  # of the trace: its filter, the last frame sent
        self._told_events = 0
        self._stamps: deque[tuple[int, int]] = deque(maxlen=_KEPT)
        self._ages: deque[float] = deque(maxlen=_AGES)

    async def run(self) -> None:
        """Send the first message, then data and answers."""
        listening = asyncio.create_task(self._listen())
        try:
            await self._send({"hello": self._source.hello})
            await self._show()
            await self._connection.close(ENDED, "the emulator has ended")
        except ConnectionClosed:
            pass
        finally:
            listening.cancel()

    async def _show(self) -> None:
        source, frames = self._source, 0
        while not source.ended.is_set():
            await source.next_frame()
            if source.stamp_ns:
                await self._connection.send(self._strips.news(source.stamp_ns))
                self._stamps.append((self._strips.number, source.stamp_ns))
            if frames % _TELL_EVERY == 0:
                with answering() as reply:
                    reply.content = self._words()
                await self._send(reply.content)
            frames += 1

    async def _listen(self) -> None:
        async for message in self._connection:
            number = None
            with answering() as reply:
                content = json_object(message)
                number = content.get("id") if isinstance(content.get("id"), int) else None
                reply.content = (await self._answer(parsed(content, OF_PANEL))).fields()
            await self._send({"answer": number, **reply.content})

    async def _answer(self, request: Request) -> Answer:
        match request:
            case ViewRequest():
                await self._view(request)
            case WatchRequest():
                self._watching, self._wanted = request.what, request.filter.lower()
                self._after = 0
            case LogRequest():
                self._look_at(request.name)
            case RowRequest():
                return RowAnswer(row=self._state.row(request.time))
            case PaintedRequest():
                self._painted(request.number)
            case _:
                return await self._source.ask(request)
        return Answer()

    async def _view(self, request: ViewRequest) -> None:
        """Follow signals, or show a window of time, whose message comes at once."""
        names = list(self._state.columns)
        if unknown := set(request.names) - set(names):
            name = unknown.pop()
            raise UserError(f"view: no signal '{brief(name)}'{did_you_mean(name, names)}")
        columns = [names.index(name) for name in request.names]
        if request.span is not None:
            self._strips.follow(columns, request.span, request.pixels, request.generation)
            return
        assert request.begin is not None
        assert request.end is not None
        self._strips.follow([], 1.0, 1, request.generation)
        between = request.begin, request.end
        window = self._strips.window(columns, between, request.pixels, request.generation)
        await self._connection.send(window)

    def _look_at(self, name: str) -> None:
        """Show another log."""
        if name not in self._source.logs:
            raise UserError(f"no log '{brief(name)}'{did_you_mean(name, self._source.logs)}")
        self._state = self._source.logs[name]
        self._strips = Strips(self._state.history)
        self._told_events = 0

    def _painted(self, number: int) -> None:
        """Store that a message is on the screen; its age includes the way back."""
        for newest, stamp_ns in self._stamps:
            if newest == number:
                self._ages.append((time.monotonic_ns() - stamp_ns) * 1e-9)

    def _latency(self) -> list[float]:
        """Return median and maximum age [s] of recent ticks when they were on the screen."""
        return [statistics.median(self._ages), max(self._ages)] if self._ages else []

    def _words(self) -> dict[str, Any]:
        """Return the slow data that the browser shows."""
        state = self._state
        events = [e for e in state.events if e[0] > self._told_events]
        self._told_events = events[-1][0] if events else self._told_events
        traffic = state.traffic
        message: dict[str, Any] = {
            "status": self._source.status, "events": events, "latency": self._latency(),
            "bus": {"rate": traffic.rate, "load": traffic.load},
            "oldest": state.history.oldest * state.history.tick, "now": state.now,
        }  # fmt: skip
        match self._watching:
            case "nodes":
                message["nodes"] = nodes(state)
            case "loop":
                kept = [name for name in PUNCTUAL if name in state.columns]
                message["loop"] = {name.partition(".")[2]: state.spread(name) for name in kept}
            case "identifiers":
                message["identifiers"] = traffic.table(state.now)
            case "trace":
                self._after, message["trace"] = traffic.trace(self._after, self._wanted, _LINES)
        return message

    async def _send(self, what: Mapping[str, Any]) -> None:
        await self._connection.send(json.dumps(what))


def nodes(state: LiveState) -> list[dict[str, Any]]:
    """Return each node's PDOs with their values, and its last emergency."""
    traffic = state.traffic
    by_node: dict[str, dict[str, Any]] = {}
    for message in traffic.pdos.values():
        node = by_node.setdefault(message.node, {"name": message.node, "pdos": []})
        stream = traffic.identifiers.get(message.identifier)
        node["pdos"].append({
            "name": message.pdo, "id": f"{message.can_id:03X}", "fields": traffic.values(message),
            "count": stream.count if stream else 0, "period": stream.period if stream else None,
            "age": state.now - stream.last_ns * 1e-9 if stream else None,
        })  # fmt: skip
    for node in by_node.values():
        number = int(node["name"].removeprefix("node"))
        emergencies = [e for can_id, e in traffic.emergencies.items() if can_id & 0x7F == number]
        node["emergency"] = (
            {"time": emergencies[0][0], "words": emergencies[0][1]} if emergencies else None
        )
    return list(by_node.values())
