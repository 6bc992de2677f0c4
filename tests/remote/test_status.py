"""The status: what the loop hands over, and what programs get of it."""

import marshal

import pytest
from rigs import START, bench, reference

from hil_emulator.faults.active import MOST
from hil_emulator.protocol.dispatch import checked
from hil_emulator.protocol.rig import (
    LONGEST_WORDS,
    MOST_FAULTS,
    FaultRequest,
    StatusAnswer,
    StatusRequest,
)
from hil_emulator.remote.rig_requests import rig_requests
from hil_emulator.remote.status import status_fields

LARGEST = 1 << 16
"""Bytes of the largest status that a program has to expect."""
LONGEST = {
    "target": f"0x{'0' * 59}185", "kind": "drop", "duration": "1000 s".ljust(80),
    "probability": "0.5".rjust(200), "seed": "1".rjust(200),
    "condition": "position > 1 m".ljust(200),
}  # fmt: skip
"""A fault with the longest texts that a request may have."""


def test_the_largest_status_is_small() -> None:
    """64 faults with the longest texts; of each the beginning is given."""
    with bench(reference()) as b:
        handlers = rig_requests(b.peer)
        for _ in range(MOST):
            handlers[FaultRequest](checked(FaultRequest, LONGEST), b.rig)
        plain = handlers[StatusRequest](StatusRequest(), b.rig)
    answer = StatusAnswer.model_validate(status_fields(plain))
    assert len(answer.faults) == MOST == MOST_FAULTS
    assert {len(fault.fault) for fault in answer.faults} == {LONGEST_WORDS}
    assert answer.faults[0].fault.startswith(f"{LONGEST['target']} drop, duration 1000 s")
    assert len(answer.model_dump_json()) < LARGEST
    assert len(marshal.dumps(plain)) < 2 * LARGEST


def test_the_status_says_how_the_rig_is() -> None:
    """State of the node, present settings in SI, faults with the time that they still last."""
    with bench(reference()) as b:
        b.tick()
        b.tick(START)
        b.rig.fault("supply", "droop", duration="3 s")
        b.rig.fault("position", "stuck", condition="position > 1 m")
        b.ticks(2)
        plain = rig_requests(b.peer)[StatusRequest](StatusRequest(), b.rig)
        answer = StatusAnswer.model_validate(status_fields(marshal.loads(marshal.dumps(plain))))
    assert answer.time == pytest.approx(b.rig.now_ns * 1e-9)
    assert [(node.id, node.state) for node in answer.nodes] == [(5, "operational")]
    assert answer.settings["external_force"] == 0.0
    assert answer.settings["lines_closed"] is None
    lasting = {fault.fault: (fault.began, fault.left) for fault in answer.faults}
    assert lasting["supply droop, duration 3 s"] == (True, pytest.approx(2.998))
    assert lasting["position stuck, condition position > 1 m"] == (False, None)
    assert answer.timing is None
