"""The loop's end of the remote control: answers requests between ticks, never waits for one."""

import contextlib
import json
import socket
import subprocess
import sys
from collections.abc import Callable
from typing import Any, Protocol

from hil_emulator.errors import UserError, brief
from hil_emulator.faults.active import Faults, Running
from hil_emulator.signals.columns import columns
from hil_emulator.signals.inputs import COMMANDS, SETTINGS, setting
from hil_emulator.wire.wire import TimedWire

_CHUNK = 1 << 16
_START_S = 20.0  # for a Python process to begin (assumed limit)


class Controlled(Protocol):
    """The rig as the control server sees it."""

    now_ns: int
    slipped_ns: int
    faults: Faults
    wire: TimedWire | None

    def fault(self, target: str, kind: str, /, **options: Any) -> Running:
        """Let something break."""
        ...

    def set(self, name: str, value: float) -> None:
        """Set a condition, SI."""
        ...

    def value(self, name: str) -> float:
        """Return a signal's present value, SI."""
        ...


class ControlServer:
    """Starts the server's process and answers what it asks.

    Args:
        port: TCP port on 127.0.0.1; 0 takes any free one.

    Attributes:
        port: the port in use.

    Raises:
        UserError: if the port cannot be listened on.

    """

    def __init__(self, port: int) -> None:
        self._socket, theirs = socket.socketpair()
        with theirs:
            self._server = subprocess.Popen(
                [
                    sys.executable,
                    "-m",
                    "hil_emulator.remote.http_server",
                    str(port),
                    str(theirs.fileno()),
                ],
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C in the terminal is for the emulator alone
            )
        self._pending = b""
        self._unsent = bytearray()
        self._socket.settimeout(_START_S)
        greeting = self._greeting()
        if "error" in greeting:
            raise UserError(f"--control {port}: {greeting['error']}; choose another port")
        self.port = int(greeting["port"])
        self._socket.setblocking(False)

    def serve(self, rig: Controlled) -> None:
        """Answer the requests that have come."""
        try:
            data = self._socket.recv(_CHUNK)
        except OSError:  # nothing has come, or the server has gone
            data = b""
        self._pending += data
        *lines, self._pending = self._pending.split(b"\n")
        for line in lines:
            request = json.loads(line)
            answer = {"id": request["id"], **answer_to(request, rig)}
            self._unsent += json.dumps(answer).encode() + b"\n"
        if self._unsent:
            with contextlib.suppress(OSError):  # the server reads it later, or is gone
                del self._unsent[: self._socket.send(self._unsent)]

    def close(self) -> None:
        """End the server; it sees that the line is cut."""
        self._socket.close()
        self._server.wait()

    def _greeting(self) -> dict[str, Any]:
        line = b""
        while not line.endswith(b"\n"):
            part = self._socket.recv(_CHUNK)
            if not part:
                return {"error": "the server ended"}
            line += part
        return dict(json.loads(line))


def answer_to(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    """Do what a request asks; return the answer, or what is wrong with it.

    Values have been checked where they are declared. Should a request still find a gap there, it
    gets an error and the loop goes on.
    """
    known: dict[str, Callable[[dict[str, Any], Controlled], dict[str, Any]]] = {
        "status": _status,
        "signals": _signals,
        "fault": _fault,
        "end": _end,
        "set": _set,
    }
    try:
        return known[request["do"]](request, rig)
    except UserError as error:
        return {"error": str(error)}
    except Exception as error:
        return {"error": f"cannot be read: {type(error).__name__}: {error}"}


def _status(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    injected = [
        {"number": r.number, "fault": str(r.fault), "began": r.began_ns is not None}
        for r in rig.faults.injected
    ]
    return {
        "time": rig.now_ns * 1e-9,
        "slipped": rig.slipped_ns * 1e-9,
        "bus_load": rig.wire.load if rig.wire else None,
        "faults": injected,
        "settings": list(SETTINGS),
    }


def _signals(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    units = columns()
    names = request.get("names") or list(units)
    unknown = [name for name in names if name not in units]
    if unknown:
        raise UserError(f"no signal '{brief(unknown[0])}'; there are {', '.join(units)}")
    return {"signals": {n: {"value": rig.value(n), "unit": units[n]} for n in names}}


def _fault(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    options = dict(request["fault"])
    if not {"target", "kind"} <= options.keys():
        raise UserError("a fault has a target and a kind")
    running = rig.fault(options.pop("target"), options.pop("kind"), **options)
    return {"number": running.number}


def _end(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    number = request.get("number")
    chosen = [r for r in rig.faults.injected if number is None or r.number == number]
    if number is not None and not chosen:
        raise UserError(f"no fault number {number} is injected")
    for running in chosen:
        running.end()
    return {"ended": [r.number for r in chosen]}


def _set(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    values = {name: setting(name, text) for name, text in dict(request["set"]).items()}
    # what a node may still refuse comes first, so that a request is obeyed as a whole or not at all
    for name in sorted(values, key=lambda name: name not in COMMANDS):
        rig.set(name, values[name])
    return {"set": values}
