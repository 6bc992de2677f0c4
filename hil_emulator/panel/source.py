"""The source of a page's data: a live bench, a recording or a result."""

import asyncio
from typing import Any, Protocol

from hil_emulator.panel.live_state import LiveState
from hil_emulator.protocol.base import Answer, Request

FRAMES_PER_S = 30
"""Messages with new data per second."""


class Source(Protocol):
    """A bench.

    Attributes:
        state: its data.
        logs: further ones, by name, that a page may show instead.
        hello: first message to a page.
        stamp_ns: when its last tick was written, by the monotonic clock [ns].
        status: last status of the loop.
        ended: set when it has ended.

    """

    state: LiveState
    logs: dict[str, LiveState]
    hello: dict[str, Any]
    stamp_ns: int
    status: dict[str, Any]
    ended: asyncio.Event

    async def next_frame(self) -> None:
        """Return when there are new data."""
        ...

    async def ask(self, request: Request) -> Answer:
        """Handle a request of a page.

        Raises:
            UserError: with the reason why it is refused.

        """
        ...
