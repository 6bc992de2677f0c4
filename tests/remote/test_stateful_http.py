"""The remote control against a model of what it has accepted, request by request."""

import json
import math
import random
from contextlib import ExitStack
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from raw_http import BULK, exchange, headers, methods, parsed, paths, request_bytes, versions
from rigs import START, bench, reference

from hil_emulator.model.declare import Param
from hil_emulator.remote.control_server import ControlServer
from hil_emulator.signals.columns import columns
from hil_emulator.signals.inputs import SETTINGS
from tests.fuzz.requests import body as body_of

VALID_FAULTS = (
    {"target": "supply", "kind": "droop", "drop": "60 bar"},
    {"target": "pressure_a", "kind": "offset", "value": "3 bar", "duration": "2 ms"},
    {"target": "position", "kind": "stuck", "condition": "position > 1 m"},
    {"target": "node5.tpdo1", "kind": "drop", "probability": 0.5},
)
VALID_SETTINGS = (
    {"supply_pressure": "120 bar"},
    {"external_force": "-200 N", "valve_current": "1 mA"},
    {"supply_pressure": "160 bar", "external_force": "0 N"},
)
BOUNDED = tuple(SETTINGS[name] for name in ("supply_pressure", "external_force"))
PLACES = ((b"POST", b"/faults"), (b"PUT", b"/settings"))

bodies = st.builds(
    lambda seed, do: body_of(random.Random(seed), do),
    st.integers(0, 2**32),
    st.sampled_from(["fault", "set"]),
)
bodies |= st.sampled_from([b"", b"{}", b"[]", b"{", b"null", b"[" * 2000, BULK])
bodies |= st.binary(max_size=40)


class RemoteControl(RuleBasedStateMachine):
    """Clients that send whatever comes to their minds, and a rig that goes on in lock-step."""

    def __init__(self) -> None:
        super().__init__()
        self.stack = ExitStack()
        self.bench = self.stack.enter_context(bench(reference()))
        self.bench.tick(START)
        self.server = ControlServer(0)
        self.stack.callback(self.server.close)
        self.accepted: set[int] = set()  # faults, and not ended since
        self.lasting: set[int] = set()  # those of them that end only at a word
        self.external_force = 0.0

    def teardown(self) -> None:
        """Let the server's process end."""
        self.stack.close()

    def serve(self) -> None:
        """Answer what has come, as the loop does between ticks."""
        self.server.serve(self.bench.rig)

    def ask(self, *parts: bytes, **unusual: Any) -> tuple[int, Any]:
        """Send a request, judge the form of its answer, and take down what it has changed."""
        request = request_bytes(self.server.port, *parts, **unusual)
        status, content = parsed(exchange(self.server.port, request, self.serve))
        if content is None:
            assert request.startswith(b"HEAD ")
            assert 400 <= status < 500
        elif status == 200:
            assert "error" not in content
            self.take_down(content)
        else:
            assert 400 <= status < 500, f"{status} {content} to {request[:200]!r}"
            assert list(content) == ["error"]
            assert isinstance(content["error"], str)
            assert content["error"]
            assert "Traceback" not in content["error"]
            assert not content["error"].startswith("cannot be done"), "a gap in the checks"
        return status, content

    def take_down(self, content: dict[str, Any]) -> None:
        """Update the expected faults by the answer to an accepted request."""
        if "number" in content:
            assert content["number"] not in self.accepted
            self.accepted.add(content["number"])
        if "ended" in content:
            assert set(content["ended"]) <= self.accepted
            self.accepted -= set(content["ended"])
            self.lasting -= set(content["ended"])
        for name, value in content.get("set", {}).items():
            assert SETTINGS[name].allows(value)
            if name == "external_force":
                self.external_force = value

    @rule(method=methods, path=paths, body=bodies, version=versions, headers=headers)
    def send_anything(
        self, method: bytes, path: bytes, body: bytes, version: bytes, headers: list[bytes]
    ) -> None:
        """Send any method with any path, headers and body."""
        self.ask(method, path, body, version=version, headers=tuple(headers))

    @rule(place=st.sampled_from(PLACES), body=bodies)
    def send_body(self, place: tuple[bytes, bytes], body: bytes) -> None:
        """Send a hostile body where one is wanted."""
        self.ask(*place, body)

    @rule(place=st.sampled_from(PLACES), cut=st.integers(1, 200))
    def hang_up_early(self, place: tuple[bytes, bytes], cut: int) -> None:
        """Send no more than the beginning of a good request: it changes nothing."""
        good = VALID_FAULTS[0] if place[1] == b"/faults" else VALID_SETTINGS[0]
        request = request_bytes(self.server.port, *place, json.dumps(good).encode())
        if answer := exchange(self.server.port, request[:-cut], self.serve):
            assert 400 <= parsed(answer)[0] < 500

    @rule(fault=st.sampled_from(VALID_FAULTS))
    def inject(self, fault: dict[str, Any]) -> None:
        """Inject a fault as one should."""
        status, content = self.ask(b"POST", b"/faults", json.dumps(fault).encode())
        assert status == 200, content
        if "duration" not in fault:
            self.lasting.add(content["number"])

    @rule(values=st.sampled_from(VALID_SETTINGS))
    def put(self, values: dict[str, Any]) -> None:
        """Set as one should."""
        status, content = self.ask(b"PUT", b"/settings", json.dumps(values).encode())
        assert status == 200, content
        assert content["set"].keys() == values.keys()

    @rule(param=st.sampled_from(BOUNDED), share=st.floats(-3.0, 3.0) | st.sampled_from([0.0, 1.0]))
    def put_a_number(self, param: Param, share: float) -> None:
        """Set what may lie out of bounds: accepted just where it does not.

        Beside a bound it may be rounded either way.
        """
        number = param.low + share * (param.high - param.low)
        if any(0.0 < abs(number - bound) < 1e-9 * abs(bound) for bound in (param.low, param.high)):
            return
        values = {param.name: f"{number!r} {param.unit}"}
        status, _ = self.ask(b"PUT", b"/settings", json.dumps(values).encode())
        assert status == (200 if param.low <= number <= param.high else 400)

    @rule(at=st.integers(0, 20), existing=st.booleans())
    def end_one(self, at: int, existing: bool) -> None:
        """End a fault that is injected, or one that never was."""
        existing = existing and bool(self.accepted)
        number = sorted(self.accepted)[at % len(self.accepted)] if existing else 10**6
        status, content = self.ask(b"DELETE", b"/faults/%d" % number)
        assert status == (200 if existing else 400)
        assert not existing or content == {"ended": [number]}

    @rule()
    def end_all(self) -> None:
        """End whatever is injected."""
        before = set(self.accepted)
        status, content = self.ask(b"DELETE", b"/faults")
        assert status == 200
        assert set(content["ended"]) == before

    @invariant()
    def the_rig_goes_on(self) -> None:
        """Let a tick pass, under the settings accepted: every signal is finite."""
        rig = self.bench.rig
        before = rig.now_ns
        self.bench.tick()
        assert rig.now_ns == before + rig.tick_ns
        assert {n: v for n in columns() if not math.isfinite(v := rig.value(n))} == {}
        assert rig.value("external_force") == self.external_force

    @invariant()
    def the_status_tells_the_faults_accepted(self) -> None:
        """Those accepted and not ended, by a word or by their duration."""
        expired = {what["end"] for _, what in self.bench.recorder.events if "end" in what}
        assert not expired & self.lasting
        self.accepted -= expired
        status, content = self.ask(b"GET", b"/status")
        assert status == 200
        assert sorted(fault["number"] for fault in content["faults"]) == sorted(self.accepted)


TestRemoteControl = pytest.mark.slow(RemoteControl.TestCase)
TestRemoteControl.settings = settings(max_examples=15, stateful_step_count=20, deadline=None)
