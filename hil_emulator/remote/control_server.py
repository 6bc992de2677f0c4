"""The loop's part of the remote control: answers requests between ticks, without waiting.

Requests come as lines of JSON. Answers are plain values as `marshal` encodes them, each after its
length (4 bytes, little-endian). The loop formats nothing, and only the process that it started
reads them.
"""

import contextlib
import json
import marshal
import socket
import sys
from collections.abc import Sequence
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import HelperProcess
from hil_emulator.protocol.dispatch import answering, json_object, parsed
from hil_emulator.remote.loop_line import LENGTH_BYTES
from hil_emulator.remote.rig_requests import Controlled, Handlers, Plain, rig_requests

_CHUNK = 1 << 16
_START_S = 20.0  # for a Python process to begin (assumed limit)

CONTROL = (
    "remote control",
    "ctl and requests over HTTP get no answer; start the run again with --control",
)
"""Name of the process that serves HTTP, and the loss if it fails."""


class ControlServer:
    """Starts the server's process and answers its requests.

    Args:
        port: TCP port on 127.0.0.1; 0 takes any free one.
        program: the server's module; its arguments are the port, the descriptor of the line to this
            process and the shared ones.
        handlers: of the requests; by default `rig_requests()`.
        shared: further descriptors that the server inherits.
        briefing: its first message, if it needs one.
        role: name of the process, and the loss if it fails; see `HelperProcess`.

    Attributes:
        port: the port in use.
        process: the server's process.

    Raises:
        UserError: if the port cannot be opened.

    """

    def __init__(
        self,
        port: int,
        program: str = "hil_emulator.remote.http_server",
        handlers: Handlers | None = None,
        shared: Sequence[int] = (),
        briefing: dict[str, Any] | None = None,
        role: tuple[str, str] = CONTROL,
    ) -> None:
        self._handlers = rig_requests() if handlers is None else handlers
        self._socket, theirs = socket.socketpair()
        with theirs:
            passed = [theirs.fileno(), *shared]
            command = [sys.executable, "-m", program, str(port), *map(str, passed)]
            self.process = HelperProcess(command, *role, pass_fds=passed)
        self._pending = b""
        self._unsent = bytearray()
        self._socket.settimeout(_START_S)
        if briefing is not None:
            self._socket.sendall(json.dumps(briefing).encode() + b"\n")
        greeting = self._greeting()
        if "error" in greeting:
            self.close()
            raise UserError(f"--control {port}: {greeting['error']}; choose another port")
        self.port = int(greeting["port"])
        self._socket.setblocking(False)

    def serve(self, rig: Controlled) -> None:
        """Answer the pending requests."""
        try:
            data = self._socket.recv(_CHUNK)
        except OSError:  # no request, or the server has ended
            data = b""
        self._pending += data
        *lines, self._pending = self._pending.split(b"\n")
        for line in lines:
            answer = marshal.dumps(answer_to(line, rig, self._handlers))
            self._unsent += len(answer).to_bytes(LENGTH_BYTES, "little") + answer
        if self._unsent:
            with contextlib.suppress(OSError):  # the server reads it later, or has ended
                del self._unsent[: self._socket.send(self._unsent)]

    def close(self) -> None:
        """End the server, which notices the closed line."""
        self._socket.close()
        self.process.close()

    def _greeting(self) -> dict[str, Any]:
        line = b""
        while b"\n" not in line:
            part = self._socket.recv(_CHUNK)
            if not part:
                return {"error": "the server ended"}
            line += part
        line, _, self._pending = line.partition(b"\n")
        return dict(json.loads(line))


def answer_to(line: bytes, rig: Controlled, handlers: Handlers) -> Plain:
    """Handle a request; return its answer as plain values, or the reason as "error"."""
    number = None
    with answering() as reply:
        content = json_object(line)
        number = content.get("id")
        request = parsed(content, tuple(handlers))
        reply.content = handlers[type(request)](request, rig)
    return {"id": number, **reply.content}
