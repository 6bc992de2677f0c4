"""Server of a recording or result in this process, until it is interrupted."""

import asyncio
import secrets
from collections.abc import Callable

from hil_emulator.panel.server_process import PORT
from hil_emulator.panel.source import Source
from hil_emulator.panel.web_server import WebServer


def show(source: Source, announce: Callable[[str], None]) -> None:
    """Serve a page until Ctrl-C; `announce` is called with its address."""

    async def serve() -> None:
        token = secrets.token_urlsafe(16)
        door = WebServer(source, token)
        async with await door.listen(PORT):
            announce(f"http://127.0.0.1:{door.port}/#{token}")
            await source.ended.wait()

    asyncio.run(serve())
