"""The process beside the loop that speaks HTTP: one local port, JSON, no other origins.

| request | does |
|---|---|
| GET /status | time, how far it has fallen behind the wall, load of a bus that takes time, faults |
| GET /signals?name=position | values in SI; all without a name |
| POST /faults {"target": ..., "kind": ..., ...} | injects a fault; answers its number |
| DELETE /faults/3, DELETE /faults | ends one, ends all |
| PUT /settings {"supply_pressure": "120 bar"} | sets |

A web page of another origin cannot use it: a request with a foreign `Origin` or `Host` is refused,
and a body has to be declared as JSON, which a foreign page may not send without being asked.
"""

import contextlib
import itertools
import json
import math
import os
import queue
import re
import socket
import sys
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs

HOST = "127.0.0.1"
_ANSWER_S = 5.0  # between two ticks an FMU may take a while (assumed limit)
_LARGEST = 1 << 16  # bytes of a body
_IDLE_S = 10.0  # a client that says nothing for so long is left (assumed)
_SHOWN = 80  # characters of a name in an answer (assumed)
_FAULT = re.compile(r"/faults(?:/(\d{1,18}))?", re.ASCII)


class LoopLine:
    """The line to the loop: one question at a time.

    Args:
        loop: the line.
        on_end: called when the loop is gone; without one, so is this process.

    """

    def __init__(self, loop: socket.socket, on_end: Callable[[], None] | None = None) -> None:
        self._on_end = on_end or (lambda: os._exit(0))
        self._loop = loop
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the loop's answer, or an error where it does not answer in time."""
        with self._lock:
            number = next(self._numbers)
            with contextlib.suppress(BrokenPipeError):  # it has ended, and that is its answer
                self._loop.sendall(json.dumps({"id": number, **request}).encode() + b"\n")
            try:
                while (answer := self._answers.get(timeout=_ANSWER_S)).pop("id", number) != number:
                    pass  # too late for the one who asked
            except queue.Empty:
                return {"error": f"the emulator's loop has not answered for {_ANSWER_S:g} s"}
            return answer

    def _listen(self) -> None:
        """Collect answers until the loop is gone."""
        with contextlib.suppress(OSError), self._loop.makefile("rb") as lines:
            for line in lines:
                self._answers.put(json.loads(line))
        self._answers.put({"error": "the emulator has ended"})
        self._on_end()


def request_of(body: bytes) -> dict[str, Any]:
    """Return a request's body: an object of text, finite numbers and truth values.

    Raises:
        ValueError: says what else it is.

    """
    try:
        content = json.loads(body)
    except RecursionError:
        raise ValueError("nested too deep: send an object of text and numbers") from None
    except ValueError as error:
        raise ValueError(f"not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ValueError("send an object")
    for name, value in content.items():
        plain = value is None or isinstance(value, str | bool | int | float)
        if not plain or (isinstance(value, float) and not math.isfinite(value)):
            raise ValueError(f"{name[:_SHOWN]}: neither text nor a finite number")
    return content


class Handler(BaseHTTPRequestHandler):
    """Turns a request into a question to the loop."""

    line: LoopLine
    server_version = "hil-emulator"
    sys_version = ""
    default_request_version = "HTTP/1.0"  # of an answer to a line that tells none: with its head
    timeout = _IDLE_S

    def do_GET(self) -> None:
        """Read."""
        path, _, query = self.path.partition("?")
        if path == "/status":
            self._ask({"do": "status"})
        elif path == "/signals":
            self._ask({"do": "signals", "names": parse_qs(query).get("name", [])})
        else:
            self._unknown()

    def do_POST(self) -> None:
        """Inject a fault."""
        if self.path == "/faults":
            self._ask_with_body("fault")
        else:
            self._unknown()

    def do_PUT(self) -> None:
        """Set."""
        if self.path == "/settings":
            self._ask_with_body("set")
        else:
            self._unknown()

    def do_DELETE(self) -> None:
        """End faults."""
        match = _FAULT.fullmatch(self.path)
        if match is None:
            self._unknown()
        else:
            self._ask({"do": "end", "number": int(match[1]) if match[1] else None})

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse what is no request, or one of a method that is not served."""
        if code == HTTPStatus.NOT_IMPLEMENTED:
            code, message = HTTPStatus.METHOD_NOT_ALLOWED, "there are GET, POST, PUT and DELETE"
        elif code == HTTPStatus.HTTP_VERSION_NOT_SUPPORTED:  # the client's mistake, not a failure
            code = HTTPStatus.BAD_REQUEST
        self.close_connection = True
        self._say(HTTPStatus(code), {"error": message or HTTPStatus(code).phrase})

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Say nothing: the terminal is the emulator's."""

    def _ask_with_body(self, do: str) -> None:
        if self.headers.get_content_type() != "application/json":
            self._say(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, {"error": "send application/json"})
            return
        length = self.headers.get("Content-Length", "0")
        if not re.fullmatch(r"\d{1,9}", length, re.ASCII) or int(length) > _LARGEST:
            self._say(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {"error": f"at most {_LARGEST} bytes"})
            return
        try:
            body = request_of(self.rfile.read(int(length)))
        except ValueError as error:
            self._say(HTTPStatus.BAD_REQUEST, {"error": str(error)})
            return
        self._ask({"do": do, do: body})

    def _ask(self, request: dict[str, Any]) -> None:
        if not self._is_local():
            self._say(HTTPStatus.FORBIDDEN, {"error": "requests of other origins are refused"})
            return
        answer = self.line.ask(request)
        self._say(HTTPStatus.BAD_REQUEST if "error" in answer else HTTPStatus.OK, answer)

    def _is_local(self) -> bool:
        """Tell whether the request is from no web page, or from one of this very server."""
        own = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}  # type: ignore[attr-defined]
        origin = self.headers.get("Origin")
        return self.headers.get("Host") in own and (
            origin is None or origin in {f"http://{name}" for name in own}
        )

    def _unknown(self) -> None:
        known = "/status, /signals, /faults, /settings"
        self._say(HTTPStatus.NOT_FOUND, {"error": f"there are {known}"})

    def _say(self, status: HTTPStatus, answer: dict[str, Any]) -> None:
        data = json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)


class Server(ThreadingHTTPServer):
    """A thread for each connection; a client that has gone is nobody's news."""

    daemon_threads = True
    request_queue_size = 128  # of a burst of clients (assumed)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a connection that broke."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


def main() -> None:
    """Serve on the port of the first argument; the second is the socket to the loop."""
    loop = socket.socket(fileno=int(sys.argv[2]))
    try:
        server = Server((HOST, int(sys.argv[1])), Handler)
    except (OSError, OverflowError) as error:
        loop.sendall(json.dumps({"error": str(error)}).encode() + b"\n")
        return
    loop.sendall(json.dumps({"port": server.server_port}).encode() + b"\n")
    Handler.line = LoopLine(loop)
    server.serve_forever()


if __name__ == "__main__":
    main()
