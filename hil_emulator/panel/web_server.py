"""The panel's port: its page, and a WebSocket that needs the token.

The page is public and contains no data of the bench. Data and commands go over the WebSocket. The
token is behind the `#` of the printed address, which browsers do not send; the page puts it into
the address of the WebSocket.
"""

import hmac
import mimetypes
from http import HTTPStatus
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from hil_emulator.panel.session import Session
from hil_emulator.panel.source import Source
from hil_emulator.remote.http_server import HOST

STREAM = "/stream"
"""Path of the websocket."""
_LARGEST = 1 << 16  # bytes of a request
_MOST = 16  # browsers at a time (assumed)
_STATIC = Path(__file__).parent / "static"
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class WebServer:
    """Serves one bench.

    Args:
        source: the bench.
        token: required to open the stream.

    Attributes:
        port: TCP port in use, once it is open.

    """

    def __init__(self, source: Source, token: str) -> None:
        self.port = 0
        self._source = source
        self._token = token
        self._pages = {f"/{file.name}": file.read_bytes() for file in _STATIC.iterdir()}
        self._pages["/"] = self._pages["/index.html"]
        self._open = 0

    async def listen(self, port: int) -> Server:
        """Open the port, or another free one if it is in use."""
        try:
            server = await self._listen(port)
        except OSError:
            server = await self._listen(0)
        self.port = next(iter(server.sockets)).getsockname()[1]
        return server

    async def _listen(self, port: int) -> Server:
        return await serve(
            self._meet, HOST, port, process_request=self._admit, compression=None,
            max_size=_LARGEST, close_timeout=1.0, server_header=None,
        )  # fmt: skip

    async def _meet(self, connection: ServerConnection) -> None:
        self._open += 1
        try:
            await Session(self._source, connection).run()
        finally:
            self._open -= 1

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a part of the page; let who may have it have the stream."""
        address = urlsplit(request.path)
        if not self._is_local(request.headers):
            return _answer(HTTPStatus.FORBIDDEN, b"requests of other origins are refused")
        if address.path == STREAM:
            given = parse_qs(address.query).get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), self._token.encode()):
                return _answer(HTTPStatus.FORBIDDEN, b"open the address that the emulator printed")
            if self._open >= _MOST:
                return _answer(HTTPStatus.SERVICE_UNAVAILABLE, b"too many pages are open")
            return None
        page = self._pages.get(address.path)
        if page is None:
            return _answer(HTTPStatus.NOT_FOUND, b"there is no such page")
        name = "index.html" if address.path == "/" else address.path
        return _answer(HTTPStatus.OK, page, mimetypes.guess_type(name)[0] or "text/plain")

    def _is_local(self, headers: Headers) -> bool:
        """Return whether a request is addressed to this server, and not sent by a foreign page."""
        addresses = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        return (
            len(hosts) == 1 and hosts[0] in addresses
            and all(origin in {f"http://{name}" for name in addresses} for origin in origins)
        )  # fmt: skip


def _answer(status: HTTPStatus, body: bytes, kind: str = "text/plain") -> Response:
    headers = Headers(_HEADERS)
    headers["Content-Type"] = f"{kind}; charset=utf-8" if kind.startswith("text") else kind
    headers["Content-Length"] = str(len(body))
    return Response(status.value, status.phrase, headers, body)
