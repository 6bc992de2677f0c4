"""The line to the loop in a server process: one request at a time; answers are formatted here."""

import contextlib
import itertools
import marshal
import os
import queue
import socket
import threading
from collections.abc import Callable
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.protocol.rig import StatusRequest
from hil_emulator.remote.status import status_fields

LENGTH_BYTES = 4
"""Bytes of the length before each answer of the loop."""
_ANSWER_S = 5.0  # between two ticks an FMU may take a while (assumed limit)


class LoopLine:
    """The line to the loop.

    Args:
        loop: the socket.
        on_end: called when the loop is gone; without one, this process exits.

    """

    def __init__(self, loop: socket.socket, on_end: Callable[[], None] | None = None) -> None:
        self._on_end = on_end or (lambda: os._exit(0))
        self._loop = loop
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def ask(self, request: Request) -> Answer:
        """Return the loop's answer.

        Raises:
            UserError: with the reason of the loop, or if it does not answer in time.

        """
        fields = self._fields(request)
        if "error" in fields:
            raise UserError(fields["error"])
        if isinstance(request, StatusRequest):
            fields = status_fields(fields)
        return request.answer.model_validate(fields)

    def _fields(self, request: Request) -> dict[str, Any]:
        with self._lock:
            number = next(self._numbers)
            line = request.model_copy(update={"id": number}).model_dump_json(by_alias=True)
            with contextlib.suppress(BrokenPipeError):  # the loop has ended
                self._loop.sendall(line.encode() + b"\n")
            try:
                while (answer := self._answers.get(timeout=_ANSWER_S)).pop("id", number) != number:
                    pass  # a late answer to an earlier request
            except queue.Empty:
                reason = f"the emulator's loop has not answered for {_ANSWER_S:g} s"
                raise UserError(reason) from None
            return answer

    def _listen(self) -> None:
        """Collect answers until the loop has ended."""
        with contextlib.suppress(OSError), self._loop.makefile("rb") as stream:
            while size := stream.read(LENGTH_BYTES):
                self._answers.put(marshal.loads(stream.read(int.from_bytes(size, "little"))))
        self._answers.put({"error": "the emulator has ended"})
        self._on_end()
