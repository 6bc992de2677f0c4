"""An emulator with its panel, in processes of their own, and a page's end of the stream."""

import asyncio
import json
import re
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from hil_emulator.platform.paths import shipped

PATIENCE_S = 60.0  # a failing test ends after this; a passing one never waits for it


@dataclass
class Bench:
    """A running emulator.

    Attributes:
        process: the emulator.
        url: of its panel, as printed.
        can_port: of its bus, where that is a TCP server.

    """

    process: subprocess.Popen[str]
    url: str
    can_port: int = 0

    @property
    def port(self) -> int:
        """Where its panel is."""
        return int(re.findall(r":(\d+)/", self.url)[0])

    @property
    def token(self) -> str:
        """What opens it."""
        return self.url.rpartition("#")[2]

    def stream(self, token: str | None = None, **options: Any) -> Any:
        """Return the way to its stream."""
        given = self.token if token is None else token
        address = f"ws://127.0.0.1:{self.port}/stream?token={given}"
        return connect(address, max_size=None, **options)


@contextmanager
def running(
    *options: str, folder: Path | None = None, bus: Sequence[str] = (), code: int = 0
) -> Iterator[Bench]:
    """Yield an emulator with a panel; it has to end as it should.

    Args:
        options: of `run`.
        folder: where it runs.
        bus: options for the bus; a virtual one by default.
        code: its exit code.

    """
    command = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]
    process = subprocess.Popen(
        [*command, *(bus or ["--bus", "virtual:panel"]), *options],
        stdout=subprocess.PIPE, text=True, cwd=folder,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        output = "".join(iter(process.stdout.readline, "Ctrl-C ends.\n"))
        (url,) = re.findall(r"^panel +(\S+)", output, re.M)
        ports = re.findall(r"^bus .*:(\d+)", output, re.M)
        yield Bench(process, url, int(ports[0]) if ports else 0)
        process.terminate()
        assert process.wait(PATIENCE_S) == code
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


class Page:
    """Client side of a page's stream: receives messages, sends requests, waits."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._asked = 0

    async def message(self) -> Any:
        """Return the next message: bytes, or decoded JSON."""
        message = await asyncio.wait_for(self._connection.recv(), PATIENCE_S)
        return message if isinstance(message, bytes) else json.loads(message)

    async def until(self, wanted: Callable[[Any], bool]) -> Any:
        """Return the first message that is wanted."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            message = await self.message()
            if wanted(message):
                return message
        raise AssertionError("the expected message did not arrive")

    async def word(self, wanted: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Return the first message in words that is wanted."""
        return dict(await self.until(lambda m: isinstance(m, dict) and bool(wanted(m))))

    async def send(self, **request: Any) -> None:
        """Send a request that has no answer."""
        await self._connection.send(json.dumps(request))

    async def ask(self, **request: Any) -> dict[str, Any]:
        """Return the answer to a request."""
        self._asked += 1
        await self.send(id=self._asked, **request)
        return await self.word(lambda m: m.get("answer") == self._asked)


def visit(bench: Bench, act: Callable[[Page], Coroutine[Any, Any, Any]]) -> Any:
    """Return what comes of a visit."""

    async def go() -> Any:
        async with bench.stream() as connection:
            return await act(Page(connection))

    return asyncio.run(go())
