"""The process beside the loop that speaks HTTP: one local port, JSON, no other origins.

| request | does |
|---|---|
| GET /status | time, faults |
| GET /signals?name=position | values in SI; all without a name |
| POST /faults {"target": ..., "kind": ..., ...} | injects a fault; answers its number |
| DELETE /faults/3, DELETE /faults | ends one, ends all |
| PUT /settings {"supply_pressure": "120 bar"} | sets |

A web page of another origin cannot use it: a request with a foreign `Origin` or `Host` is refused,
and a body has to be declared as JSON, which a foreign page may not send without being asked.
"""

import itertools
import json
import os
import queue
import socket
import sys
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

HOST = "127.0.0.1"
_ANSWER_S = 5.0  # a loop that follows SYNC may wait for a controller (assumed limit)
_LARGEST = 1 << 16  # bytes of a body


class Line:
    """The line to the loop: one question at a time."""

    def __init__(self, loop: socket.socket) -> None:
        self._loop = loop
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the loop's answer, or an error where it does not answer in time."""
        with self._lock:
            number = next(self._numbers)
            self._loop.sendall(json.dumps({"id": number, **request}).encode() + b"\n")
            try:
                while (answer := self._answers.get(timeout=_ANSWER_S)).pop("id") != number:
                    pass  # too late for the one who asked
            except queue.Empty:
                return {"error": "no time passes in the emulator: it waits for SYNC"}
            return answer

    def _listen(self) -> None:
        """Collect answers; when the loop is gone, so is this process."""
        with self._loop.makefile("rb") as lines:
            for line in lines:
                self._answers.put(json.loads(line))
        os._exit(0)


class Handler(BaseHTTPRequestHandler):
    """Turns a request into a question to the loop."""

    line: Line
    server_version = "hil-emulator"
    sys_version = ""

    def do_GET(self) -> None:
        """Read."""
        url = urlsplit(self.path)
        if url.path == "/status":
            self._ask({"do": "status"})
        elif url.path == "/signals":
            self._ask({"do": "signals", "names": parse_qs(url.query).get("name", [])})
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
        number = self.path.removeprefix("/faults").removeprefix("/")
        if not self.path.startswith("/faults") or not (number == "" or number.isdecimal()):
            self._unknown()
        else:
            self._ask({"do": "end", "number": int(number) if number else None})

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Say nothing: the terminal is the emulator's."""

    def _ask_with_body(self, do: str) -> None:
        if self.headers.get_content_type() != "application/json":
            self._say(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, {"error": "send application/json"})
            return
        length = self.headers.get("Content-Length", "0")
        if not length.isdecimal() or int(length) > _LARGEST:
            self._say(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {"error": f"at most {_LARGEST} bytes"})
            return
        try:
            body = json.loads(self.rfile.read(int(length)))
        except ValueError as error:
            self._say(HTTPStatus.BAD_REQUEST, {"error": f"not JSON: {error}"})
            return
        if not isinstance(body, dict):
            self._say(HTTPStatus.BAD_REQUEST, {"error": "send an object"})
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
        self.wfile.write(data)


def main() -> None:
    """Serve on the port of the first argument; the second is the socket to the loop."""
    loop = socket.socket(fileno=int(sys.argv[2]))
    try:
        server = ThreadingHTTPServer((HOST, int(sys.argv[1])), Handler)
    except (OSError, OverflowError) as error:
        loop.sendall(json.dumps({"error": str(error)}).encode() + b"\n")
        return
    server.daemon_threads = True
    loop.sendall(json.dumps({"port": server.server_port}).encode() + b"\n")
    Handler.line = Line(loop)
    server.serve_forever()


if __name__ == "__main__":
    main()
