"""Requests down to their bytes, so that they can be wrong, and answers that must not be."""

import json
import socket
import time
from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

PATIENCE_S = 30.0  # a failing test ends after this; a passing one never waits for it

BULK = b"{bulk}"  # stands for more than a line or a body may have
METHODS = (b"GET", b"POST", b"PUT", b"DELETE")
ODD_METHODS = (b"HEAD", b"OPTIONS", b"PATCH", b"TRACE", b"BREW", b"get", b"__init__", b"\xff")
PATHS = (b"/status", b"/signals", b"/signals?name=position", b"/faults", b"/faults/0", b"/settings")
HOSTILE_PATHS = (
    *(b"/", b"//[", b"*", b"/faults/-1", b"/faults/" + b"9" * 5000, b"/faults7", b"/faults/\xb2"),
    *(b"/../status", b"/status?" + BULK, b"http://evil.test/status", b"/%00", b"/a b c"),
    *(b"/signals?name=speed", b"/signals?name=%ff&name=%00", b"/signals?" + b"name=time&" * 200),
)
VERSIONS = (b" HTTP/1.1", b" HTTP/1.0", b" HTTP/2.0", b" HTTP/9", b" FTP/1.1", b" HTTP/1.x", b"")
JSON = b"Content-Type: application/json"
HOSTILE_HEADERS = (
    *(b"Origin: null", b"Origin: http://evil.test", b"Host: evil.test"),
    *(b"Content-Type: text/plain", b"Content-Type: ;;;", b"Content-Length: " + b"9" * 5000),
    *(b"Content-Length: -1", b"Content-Length: many", b"Content-Length: \xb2"),
    *(b"Content-Length: 70000", b"Transfer-Encoding: chunked", b"Content-Encoding: gzip"),
    *(b"X: " + BULK, b"\r\n".join([b"X: y"] * 150), b"no header", b": ", b" folded"),
    *(b"\xff", b"Expect: 100-continue", b"Connection: keep-alive"),
)

methods = st.sampled_from(METHODS) | st.sampled_from(ODD_METHODS)
paths = (
    st.sampled_from(PATHS)
    | st.sampled_from(HOSTILE_PATHS)
    | st.binary(max_size=20).map(lambda tail: b"/" + tail)
)
versions = st.just(VERSIONS[0]) | st.sampled_from(VERSIONS)
headers = st.lists(st.just(JSON) | st.sampled_from(HOSTILE_HEADERS), max_size=3)


def request_bytes(
    port: int,
    method: bytes,
    path: bytes,
    body: bytes = b"",
    version: bytes = VERSIONS[0],
    headers: tuple[bytes, ...] = (JSON,),
) -> bytes:
    """Return a request; headers given come before the right ones, so that the server sees them."""
    body = body.replace(BULK, b"x" * 70_000)
    right = (b"Host: 127.0.0.1:%d" % port, b"Content-Length: %d" % len(body))
    lines = b"\r\n".join([method + b" " + path + version, *headers, *right, b"", body])
    return lines.replace(BULK, b"x" * 70_000)


def exchange(port: int, request: bytes, meanwhile: Callable[[], None]) -> bytes:
    """Send bytes and hang up; return all that is answered while something else goes on."""
    answer = b""
    deadline = time.monotonic() + PATIENCE_S
    with socket.create_connection(("127.0.0.1", port)) as client:
        try:
            client.sendall(request)
            client.shutdown(socket.SHUT_WR)
        except OSError:  # it was refused before it was read to its end
            pass
        client.settimeout(0.002)
        while time.monotonic() < deadline:
            meanwhile()
            try:
                part = client.recv(1 << 16)
            except TimeoutError:
                continue
            except ConnectionResetError:
                return answer
            if not part:
                return answer
            answer += part
    raise AssertionError(f"no end of the answer to {request[:200]!r}")


def parsed(answer: bytes) -> tuple[int, Any]:
    """Return status and content of an answer; None for the content that HEAD leaves out."""
    head, _, body = answer.partition(b"\r\n\r\n")
    first, *fields = head.split(b"\r\n")
    version, status, _ = first.split(b" ", 2)
    assert version == b"HTTP/1.0", answer
    named = dict(field.split(b": ", 1) for field in fields)
    assert named[b"Content-Type"] == b"application/json"
    if not body:
        return int(status), None
    assert int(named[b"Content-Length"]) == len(body)
    return int(status), json.loads(body)
