"""What a page shows, whether it lives or is over: the bench as the browsers' sessions see it."""

import asyncio
from typing import Any, Protocol

from hil_emulator.panel.live_state import LiveState
from hil_emulator.protocol.base import Answer, Request

FRAMES_PER_S = 30
"""How often a page gets what is new."""


class Source(Protocol):
    """A bench.

    Attributes:
        state: what has come of it.
        logs: further ones, by name, that a page may look at instead.
        hello: what a page is told first.
        stamp_ns: when its last tick was written, by the monotonic clock [ns].
        status: how it is: what the loop answered last.
        ended: set when it is over.

    """

    state: LiveState
    logs: dict[str, LiveState]
    hello: dict[str, Any]
    stamp_ns: int
    status: dict[str, Any]
    ended: asyncio.Event

    async def next_frame(self) -> None:
        """Return when there is something new to show."""
        ...

    async def ask(self, request: Request) -> Answer:
        """Do what a page asks for.

        Raises:
            UserError: with the reason why it is refused.

        """
        ...
