"""The process that serves HTTP: one local port, JSON, no other origins.

A web page of another origin cannot use it: a request with a foreign `Origin` or `Host` is refused,
and a body must be declared as JSON, for which a browser needs a permission that is not given.
"""

import json
import re
import socket
import sys
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs

from hil_emulator.errors import UserError
from hil_emulator.protocol.base import Request, WithOptions
from hil_emulator.protocol.dispatch import answering, checked, json_object
from hil_emulator.protocol.rig import (
    EndRequest,
    FaultRequest,
    SetRequest,
    SignalsRequest,
    StatusRequest,
)
from hil_emulator.remote.loop_line import LoopLine

HOST = "127.0.0.1"
_LARGEST = 1 << 16  # bytes of a body
_IDLE_S = 10.0  # a silent client is disconnected after this time (assumed)
_FAULT = re.compile(r"/faults/(\d{1,18})", re.ASCII)

ROUTES: Mapping[tuple[str, str], type[Request]] = {
    ("GET", "/status"): StatusRequest,
    ("GET", "/signals"): SignalsRequest,
    ("POST", "/faults"): FaultRequest,
    ("DELETE", "/faults"): EndRequest,
    ("DELETE", "/faults/NUMBER"): EndRequest,
    ("PUT", "/settings"): SetRequest,
}
"""Requests by method and path. A body is the JSON object of their fields; `GET /signals` takes
names as its query."""


class Handler(BaseHTTPRequestHandler):
    """Passes a request to the loop."""

    line: LoopLine
    server_version = "hil-emulator"
    sys_version = ""
    # for a request line without a version: the answer then has a header
    default_request_version = "HTTP/1.0"
    timeout = _IDLE_S

    def do_GET(self) -> None:
        """Answer a request of any method with a route."""
        path, _, query = self.path.partition("?")
        fault = _FAULT.fullmatch(path)
        verb = ROUTES.get((self.command, "/faults/NUMBER" if fault else path))
        if verb is None:
            paths = ", ".join(dict.fromkeys(path for _, path in ROUTES))
            self._respond(HTTPStatus.NOT_FOUND, {"error": f"there are {paths}"})
        elif not self._is_local():
            self._respond(HTTPStatus.FORBIDDEN, {"error": "requests of other origins are refused"})
        elif issubclass(verb, WithOptions):
            self._ask_with_body(verb)
        elif verb is SignalsRequest:
            self._ask(verb, {"names": parse_qs(query).get("name", [])})
        else:
            self._ask(verb, {"number": int(fault[1])} if fault else {})

    do_POST = do_PUT = do_DELETE = do_GET  # noqa: N815 - the names that http.server looks for

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse an invalid request, or another method."""
        if code == HTTPStatus.NOT_IMPLEMENTED:
            code, message = HTTPStatus.METHOD_NOT_ALLOWED, "there are GET, POST, PUT and DELETE"
        elif code == HTTPStatus.HTTP_VERSION_NOT_SUPPORTED:  # the client's mistake, not a failure
            code = HTTPStatus.BAD_REQUEST
        self.close_connection = True
        self._respond(HTTPStatus(code), {"error": message or HTTPStatus(code).phrase})

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Print nothing: the terminal belongs to the emulator."""

    def _ask_with_body(self, verb: type[Request]) -> None:
        if self.headers.get_content_type() != "application/json":
            self._respond(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, {"error": "send application/json"})
            return
        length = self.headers.get("Content-Length", "0")
        if not re.fullmatch(r"\d{1,9}", length, re.ASCII) or int(length) > _LARGEST:
            self._respond(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {"error": f"at most {_LARGEST} bytes"}
            )
            return
        try:
            fields = json_object(self.rfile.read(int(length)))
        except UserError as error:
            self._respond(HTTPStatus.BAD_REQUEST, {"error": str(error)})
            return
        self._ask(verb, fields)

    def _ask(self, verb: type[Request], fields: Mapping[str, Any]) -> None:
        with answering() as reply:
            reply.content = self.line.ask(checked(verb, fields)).fields()
        failed = "error" in reply.content
        self._respond(HTTPStatus.BAD_REQUEST if failed else HTTPStatus.OK, reply.content)

    def _is_local(self) -> bool:
        """Return whether the request is from no web page, or from one of this server."""
        hosts = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}  # type: ignore[attr-defined]
        origin = self.headers.get("Origin")
        return self.headers.get("Host") in hosts and (
            origin is None or origin in {f"http://{name}" for name in hosts}
        )

    def _respond(self, status: HTTPStatus, answer: Mapping[str, Any]) -> None:
        data = json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)


class Server(ThreadingHTTPServer):
    """A thread for each connection; a closed connection is not reported."""

    daemon_threads = True
    request_queue_size = 128  # of a burst of clients (assumed)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a broken connection."""
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
