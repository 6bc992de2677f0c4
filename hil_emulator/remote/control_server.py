"""The loop's end of the remote control: answers requests between ticks, never waits for one."""

import contextlib
import json
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from hil_emulator.errors import UserError, brief
from hil_emulator.faults.active import Faults
from hil_emulator.faults.running import Running
from hil_emulator.platform.helper_process import HelperProcess
from hil_emulator.signals.columns import columns
from hil_emulator.signals.inputs import COMMANDS, SETTINGS, setting
from hil_emulator.wire.wire import TimedWire

_CHUNK = 1 << 16
_START_S = 20.0  # for a Python process to begin (assumed limit)

CONTROL = (
    "remote control",
    "ctl and requests over HTTP get no answer; start the run again with --control",
)
"""Name of the process that speaks HTTP, and what is lost with it."""


class Controlled(Protocol):
    """The rig as the control server sees it."""

    now_ns: int
    slipped_ns: int
    faults: Faults
    wire: TimedWire | None

    def fault(self, target: str, kind: str, /, **options: Any) -> Running:
        """Let something break."""
        ...

    def set(self, name: str, value: float) -> str:
        """Set a condition, SI; return what it waits for, "" for nothing."""
        ...

    def value(self, name: str) -> float:
        """Return a signal's present value, SI."""
        ...


Answers = Mapping[str, Callable[[dict[str, Any], Any], dict[str, Any]]]
"""By what a request wants done: the function of request and rig that does it and tells."""


class ControlServer:
    """Starts the server's process and answers what it asks.

    Args:
        port: TCP port on 127.0.0.1; 0 takes any free one.
        program: the server's module; gets the port, the descriptor of the line to this process and
            those that it shares as arguments.
        answers: what can be asked; `ANSWERS` without any.
        shared: descriptors that the server inherits besides.
        briefing: what it is told first, where it asks for that.
        role: name of the process, and what is lost with it; see `HelperProcess`.

    Attributes:
        port: the port in use.
        process: the server's process.

    Raises:
        UserError: if the port cannot be listened on.

    """

    def __init__(
        self,
        port: int,
        program: str = "hil_emulator.remote.http_server",
        answers: Answers | None = None,
        shared: Sequence[int] = (),
        briefing: dict[str, Any] | None = None,
        role: tuple[str, str] = CONTROL,
    ) -> None:
        self._answers = ANSWERS if answers is None else answers
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
        """Answer the requests that have come."""
        try:
            data = self._socket.recv(_CHUNK)
        except OSError:  # nothing has come, or the server has gone
            data = b""
        self._pending += data
        *lines, self._pending = self._pending.split(b"\n")
        for line in lines:
            request = json.loads(line)
            answer = {"id": request["id"], **answer_to(request, rig, self._answers)}
            self._unsent += json.dumps(answer).encode() + b"\n"
        if self._unsent:
            with contextlib.suppress(OSError):  # the server reads it later, or is gone
                del self._unsent[: self._socket.send(self._unsent)]

    def close(self) -> None:
        """End the server; it sees that the line is cut."""
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


def answer_to(
    request: dict[str, Any], rig: Controlled, known: Answers | None = None
) -> dict[str, Any]:
    """Do what a request asks; return the answer, or what is wrong with it.

    Values have been checked where they are declared. Should a request still find a gap there, it
    gets an error and the loop goes on.
    """
    try:
        return (ANSWERS if known is None else known)[request["do"]](request, rig)
    except UserError as error:
        return {"error": str(error)}
    except Exception as error:
        return {"error": f"cannot be read: {type(error).__name__}: {error}"}


def _status(request: dict[str, Any], rig: Controlled) -> dict[str, Any]:
    injected = [
        {
            "number": r.number,
            "fault": str(r.fault),
            "began": r.began_ns is not None,
            "left": _left(r, rig.now_ns),
        }
        for r in rig.faults.injected
    ]
    return {
        "time": rig.now_ns * 1e-9,
        "slipped": rig.slipped_ns * 1e-9,
        "bus_load": rig.wire.load if rig.wire else None,
        "faults": injected,
        "settings": list(SETTINGS),
    }


def _left(running: Running, now_ns: int) -> float | None:
    """Return how long a fault still lasts [s]; None until it is ended."""
    duration_ns, began_ns = running.fault.duration_ns, running.began_ns
    if duration_ns is None:
        return None
    return (duration_ns if began_ns is None else began_ns + duration_ns - now_ns) * 1e-9


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
    ordered = sorted(values, key=lambda name: name not in COMMANDS)
    waits = [told for name in ordered if (told := rig.set(name, values[name]))]
    return {"set": values, **({"waits": waits} if waits else {})}


ANSWERS: Answers = {
    "status": _status,
    "signals": _signals,
    "fault": _fault,
    "end": _end,
    "set": _set,
}
"""What HTTP requests ask for."""
