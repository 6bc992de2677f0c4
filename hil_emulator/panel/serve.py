"""The process that serves the panel; started by `server_process.Panel`.

It runs at a lower priority than everything else, reads the shared memory and sends requests to the
loop over a private socket.
"""

import asyncio
import contextlib
import json
import os
import signal
import socket
import sys

from hil_emulator.panel.live import LiveBench
from hil_emulator.panel.ring import RingReader
from hil_emulator.panel.web_server import WebServer
from hil_emulator.remote.loop_line import LoopLine

_FAREWELL_S = 2.0  # for pages to leave (assumed)
_NICENESS = 10  # below ordinary work (assumed)


async def serve(port: int, loop: socket.socket, ring: RingReader) -> None:
    """Serve on a port until the loop has ended."""
    with loop.makefile("rb") as lines:
        info = json.loads(lines.readline())
    clock = asyncio.get_running_loop()
    ended = asyncio.Event()

    def over() -> None:
        clock.call_soon_threadsafe(ended.set)

    line = LoopLine(loop, over)
    bench = LiveBench(info, ring, line)
    bench.ended = ended
    door = WebServer(bench, info["token"])
    server = await door.listen(port)
    loop.sendall(json.dumps({"port": door.port}).encode() + b"\n")
    looking = asyncio.create_task(bench.look())
    await bench.pump()
    looking.cancel()
    await bench.close()
    server.close(close_connections=False)  # after their last message
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(server.wait_closed(), _FAREWELL_S)


def main() -> None:
    """Serve on the port of the first argument; the others are the line to the loop and the ring."""
    port, line, ring = map(int, sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICENESS)
    asyncio.run(serve(port, socket.socket(fileno=line), RingReader(ring)))


if __name__ == "__main__":
    main()
