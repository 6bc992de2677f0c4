"""A page's session inside this process: no request ends it."""

import asyncio
import json
import marshal
import os
import tempfile
import tracemalloc
from collections.abc import AsyncIterator, Iterator
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from rigs import START, Bench, bench, reference

from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.panel import objects, session_info
from hil_emulator.panel.hand import MasterByHand
from hil_emulator.panel.live import LiveBench
from hil_emulator.panel.live_state import LiveState
from hil_emulator.panel.loop_publisher import published_columns
from hil_emulator.panel.loop_requests import loop_requests
from hil_emulator.panel.session import Session
from hil_emulator.panel.strips import Strips
from hil_emulator.protocol.base import Answer, Request
from hil_emulator.protocol.offered import OF_PANEL
from hil_emulator.protocol.operation import SdoRequest
from hil_emulator.protocol.page import MOST_COLUMNS, MOST_PIXELS
from hil_emulator.protocol.rig import StatusRequest
from hil_emulator.recording.header import header
from hil_emulator.remote.control_server import answer_to
from hil_emulator.remote.status import status_fields
from hil_emulator.simulation.loop import Timing

HOSTILE: tuple[Any, ...] = (
    *(None, True, -1, 0, 256, 65536, 10**19, 10**400, 0.5, 1e300, -1e300, float("nan")),
    *(float("inf"), "", "-1", "256", "10000", "0x1008", "x" * 300, "x" * 50_000, "\0", "\ud800"),
    *([], {}, ["time"] * 3000, "time " * 3000, [[[[]]]], "model.position", "nodes", "loop"),
)
VALID: dict[str, dict[str, Any]] = {
    "fault": {"target": "pressure_a", "kind": "off"},
    "nmt": {"command": "start", "node": 5},
    "sdo": {"node": 5, "index": "0x1008", "subindex": 0},
    "view": {"columns": "time model.position", "pixels": 100, "generation": 1, "span": 1.0},
    "log": {"name": "run"},
    "row": {"time": 0.0},
    "painted": {"number": 1},
}
"""By request: arguments that are right, of which some are replaced."""


class Line:
    """The line to a loop in this process, which answers at once."""

    def __init__(self, here: Bench) -> None:
        self._here = here
        self._handlers = loop_requests(MasterByHand(here.rig.bus), here.peer, Timing())

    def ask(self, request: Request) -> Answer:
        """Answer as the loop does, values carried as they are between processes."""
        line = request.model_dump_json(by_alias=True).encode()
        plain = answer_to(line, self._here.rig, self._handlers)
        fields = marshal.loads(marshal.dumps(plain))
        assert not str(fields.get("error")).startswith("cannot be done"), fields
        if "error" in fields:
            raise UserError(fields["error"])
        del fields["id"]
        fields = status_fields(fields) if isinstance(request, StatusRequest) else fields
        return request.answer.model_validate(fields)


class Unhurried(LiveBench):
    """A bench that always has news, so that every message of a session is made."""

    async def next_frame(self) -> None:
        """Let others go on."""
        self.stamp_ns = 1
        await asyncio.sleep(0)


class Connection:
    """The connection to a page in this process."""

    def __init__(self) -> None:
        self.to_session: asyncio.Queue[str] = asyncio.Queue()
        self.answers: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    async def __aiter__(self) -> AsyncIterator[str]:
        while True:
            yield await self.to_session.get()

    async def send(self, message: str | bytes) -> None:
        """Take a message; keep it if it answers a request."""
        content = json.loads(message) if isinstance(message, str) else {}
        assert set(content) != {"error"}, content
        if "answer" in content:
            self.answers.put_nowait(content)

    async def close(self, code: int, reason: str) -> None:
        """End."""

    async def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request; return the next answer."""
        self.to_session.put_nowait(json.dumps(request))
        return await asyncio.wait_for(self.answers.get(), 30.0)


@pytest.fixture(scope="module")
def source() -> Iterator[Unhurried]:
    """Yield a bench whose node is OPERATIONAL and answers no SDO client in time."""
    config = reference()
    with (
        pytest.MonkeyPatch.context() as patch,
        tempfile.TemporaryDirectory() as folder,
        bench(config) as here,
    ):
        patch.setattr(objects, "_PATIENCE_S", 1e-3)
        patch.chdir(folder)
        here.tick(START)
        info = {
            "header": header(config, here.rig.nodes, capture="test"),
            "columns": published_columns(),
            "bit_rate": config.wire.assumed_bit_rate,
            "machine": session_info.machine(config),
            "view_only": False,
            "eds": {str(n.id): str(n.eds) for n in config.nodes},
        }
        live = Unhurried(info, None, Line(here))  # type: ignore[arg-type]
        rows = np.zeros((50, len(published_columns())))
        rows[:, 0] = np.arange(50) * config.tick_ns * 1e-9
        live.state.history.append(rows)
        live.logs = {"run": live.state}
        yield live
        assert os.listdir(folder) == []


async def exchange(source: LiveBench, *requests: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the answers to requests of one session."""
    connection = Connection()
    task = asyncio.create_task(Session(source, connection).run())  # type: ignore[arg-type]
    answers = [await connection.ask(**request) for request in requests]
    task.cancel()
    return answers


@pytest.mark.parametrize("verb", OF_PANEL, ids=lambda verb: verb.verb())
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_a_session_outlives_every_request(
    source: Unhurried, verb: type[Request], data: st.DataObject
) -> None:
    """A malformed request is answered, with the reason; so is the right one after it."""
    do = verb.verb()
    names = [field.alias or name for name, field in verb.model_fields.items() if name != "do"]
    names += ["supply_pressure", "duration"]
    wrong = data.draw(st.dictionaries(st.sampled_from(names), st.sampled_from(HOSTILE), min_size=1))
    answers = asyncio.run(
        exchange(
            source,
            {"do": do, **VALID.get(do, {}), **wrong},
            {"do": "watch", "id": 1, "what": "loop"},
            {"do": "row", "id": 2, "time": 0.01},
        )
    )
    assert answers[0].keys() - {"answer"} <= {"error", *verb.answer.model_fields}
    assert not str(answers[0].get("error")).startswith("cannot be done"), "a gap in the checks"
    assert answers[1] == {"answer": 1}
    assert answers[2]["row"][0] == pytest.approx(0.01)


@given(st.text(max_size=30) | st.sampled_from(["[" * 5000, '{"do": 1e999}', "9" * 5000]))
@settings(max_examples=30, deadline=None)
def test_a_session_outlives_what_is_no_request(source: Unhurried, text: str) -> None:
    """Text that is no JSON object, or has no known `do`, is answered with the reason."""

    async def go() -> list[dict[str, Any]]:
        connection = Connection()
        task = asyncio.create_task(Session(source, connection).run())  # type: ignore[arg-type]
        connection.to_session.put_nowait(text)
        answers = [await connection.answers.get(), await connection.ask(do="row", id=1, time=0.0)]
        task.cancel()
        return answers

    answers = asyncio.run(go())
    assert "error" in answers[0]
    assert "row" in answers[1]


@pytest.mark.parametrize("verb", OF_PANEL, ids=lambda verb: verb.verb())
def test_a_right_request_is_obeyed(source: Unhurried, verb: type[Request]) -> None:
    """The answer has the declared fields; SDO requests may time out without a running loop."""
    do = verb.verb()
    (answer,) = asyncio.run(exchange(source, {"do": do, "id": 7, **VALID.get(do, {})}))
    assert answer["answer"] == 7
    if do == "sdo":
        assert answer["error"] == "SDO: No SDO response received"
        return
    assert answer.keys() - {"answer"} == set(verb.answer.model_fields)


def test_a_panel_that_only_shows_refuses_what_acts_on_the_bench(
    source: Unhurried, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What only reads is answered there, too."""
    monkeypatch.setattr(source, "view_only", True)
    verbs = [verb.verb() for verb in OF_PANEL]
    requests = [{"do": do, "id": n, **VALID.get(do, {})} for n, do in enumerate(verbs)]
    answers = asyncio.run(exchange(source, *requests))
    refused = {verbs[a["answer"]] for a in answers if "only shows" in a.get("error", "")}
    assert refused == {"fault", "end", "set", "nmt", "sdo", "record", "marker", "play"}
    assert all("error" not in a for a in answers if verbs[a["answer"]] not in refused)


def test_the_largest_view_takes_little_memory() -> None:
    """The widest view of most signals needs little more than its message, at every width."""
    columns = {"time": "s"} | {f"signal {i}": "1" for i in range(MOST_COLUMNS - 1)}
    state = LiveState({"tick_ns": 1_000_000, "messages": []}, columns, 1e6)
    rows = np.zeros((1000, len(columns)))
    message = 2 * MOST_COLUMNS * MOST_PIXELS * 4
    strips = Strips(state.history)
    for first in range(0, 120_000, 1000):
        rows[:, 0] = (first + np.arange(1000)) * 1e-3
        state.history.append(rows)
    for span in ((0.0, 120.0), (60.0, 100.0), (118.0, 120.0)):
        tracemalloc.start()
        strips.window(range(MOST_COLUMNS), span, MOST_PIXELS, 1)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 5 * message, (span, peak)


def test_a_faulty_frame_does_not_disturb_sdo_by_hand() -> None:
    """Heartbeats, emergencies and answers of a wrong length are heard like any others."""
    by_hand = objects.ObjectsByHand(lambda can_id, data: None, {})
    lengths = range(9)
    identifiers = (0x085, 0x185, 0x585, 0x705, 0x7E4)
    request = SdoRequest(node=5, index=0x1008, subindex=0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "_PATIENCE_S", 1e-3)
        for _ in range(2):  # the first access makes a client, which then hears
            with pytest.raises(UserError, match=r"^SDO: "):
                asyncio.run(by_hand.access(request))
            by_hand.hear((0, True, Frame(i, bytes(n))) for i in identifiers for n in lengths)
