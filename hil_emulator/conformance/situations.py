"""Triggers of a TPDO (remote frame, event, timer, SYNC), and the expected number of frames."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from hil_emulator.conformance.demands import need_object, need_remote_frames, need_writable
from hil_emulator.conformance.device import (
    OPERATIONAL,
    PRE_OPERATIONAL,
    SYNC_COB_ID,
    SYNC_OVERFLOW,
    Device,
)
from hil_emulator.conformance.pdo import EVENT_DRIVEN, REFUSED, SYNC_START, Pdo, usable
from hil_emulator.conformance.sdo_client import Aborted
from hil_emulator.conformance.wire import NS_PER_MS

SYNC = 0x080
ON_REQUEST, ACYCLIC, EVERY, EVERY_SECOND = 253, 0, 1, 2
PAUSE_MS = 10
"""Time between two frames of the suite (assumed)."""
WATCH_MS = 500
INHIBIT_MS, EVENT_MS = 50, 20
OVERFLOW, START_VALUE = 8, 3


@dataclass(frozen=True)
class Situation:
    """One way to trigger a TPDO.

    Attributes:
        demand: skips the case if device or bus do not support it.
        configure: sets the parameters of a disabled TPDO.
        provoke: triggers the TPDO in OPERATIONAL; takes the device and the TPDO's identifier.
        judge: checks the number of frames in OPERATIONAL; takes this number and the duration of
            `provoke` in ms.
        overflow: of the SYNC counter, 0 without a counter.

    """

    demand: Callable[[Device], None]
    configure: Callable[[Pdo], None]
    provoke: Callable[[Device, int], None]
    judge: Callable[[int, float], None]
    overflow: int = 0


def check_sent(device: Device, situation: Situation) -> None:
    """Check for each TPDO that it is sent in OPERATIONAL the expected number of times."""
    situation.demand(device)
    for pdo in usable(device, situation.overflow):
        configure(device, situation, pdo)
        size, can_id = pdo.size(), pdo.can_id
        since = len(device.wire.log)
        begin_ns = device.wire.now_ns
        device.enter(OPERATIONAL)
        situation.provoke(device, can_id)
        device.barrier()
        frames = device.wire.heard(can_id, since)
        assert all(len(data) == size for data in frames), f"{pdo.name}: not {size} bytes long"
        situation.judge(len(frames), (device.wire.now_ns - begin_ns) / NS_PER_MS)
        device.enter(PRE_OPERATIONAL)
        pdo.disable()


def check_not_sent(device: Device, situation: Situation, state: int) -> None:
    """Check that no TPDO is sent in a state other than OPERATIONAL."""
    situation.demand(device)
    identifiers = []
    for pdo in usable(device, situation.overflow):
        configure(device, situation, pdo)
        identifiers.append(pdo.can_id)
    device.enter(OPERATIONAL)
    device.enter(state)
    since = len(device.wire.log)
    for can_id in identifiers:
        situation.provoke(device, can_id)
    for can_id in identifiers:
        assert device.wire.heard(can_id, since) == [], f"{can_id:03X} was sent in state {state}"


def configure(device: Device, situation: Situation, pdo: Pdo) -> None:
    """Configure and enable a TPDO; skip the case if the device refuses the setting."""
    try:
        situation.configure(pdo)
        pdo.enable(remote=situation is REMOTE)
    except Aborted as abort:
        if abort.code not in REFUSED:
            raise
        pytest.skip(f"{pdo.name} does not offer this transmission: {abort}")


def check_rate(count: int, elapsed_ms: float, period_ms: float, what: str) -> None:
    """Check the number of periodic frames, with a tolerance of 25 % for slow buses and clocks."""
    periods = elapsed_ms / period_ms
    likely = 0.75 * periods - 2 <= count <= periods + 2
    assert likely, f"{count} frames in {elapsed_ms:.0f} ms: {what} {period_ms:.0f} ms"


def _no_demand(device: Device) -> None:
    """Require no optional service: events and timers need only their parameters."""


def _ask(device: Device, can_id: int) -> None:
    for _ in range(3):
        device.wire.send(can_id, remote=True)
        device.wire.run(PAUSE_MS)


def _watch(device: Device, can_id: int) -> None:
    device.wire.run(WATCH_MS)


def _sync(device: Device, counters: range | None, count: int = 6) -> None:
    for counter in counters or range(count):
        device.wire.send(SYNC, b"" if counters is None else bytes([counter]))
        device.wire.run(PAUSE_MS)


def _exactly(expected: int) -> Callable[[int, float], None]:
    def judge(count: int, elapsed_ms: float) -> None:
        assert count == expected, f"{count} frames, not {expected}"

    return judge


def _on_event(count: int, elapsed_ms: float) -> None:
    most = elapsed_ms / INHIBIT_MS + 2
    assert count <= most, f"{count} frames in {elapsed_ms:.0f} ms: inhibit time {INHIBIT_MS} ms"
    if count == 0:
        pytest.skip("nothing happened that the device sends an event for")


def _by_timer(count: int, elapsed_ms: float) -> None:
    check_rate(count, elapsed_ms, EVENT_MS, "event timer")


def _acyclic(count: int, elapsed_ms: float) -> None:
    assert count <= 6, f"{count} frames for 6 SYNC"
    if count == 0:
        pytest.skip("nothing happened that the device sends an event for")


def _consumes_sync(device: Device) -> None:
    need_object(device, SYNC_COB_ID)


def _counts_sync(device: Device) -> None:
    need_object(device, SYNC_COB_ID)
    need_writable(device, SYNC_OVERFLOW)
    if not any(subindex == SYNC_START for _, subindex in device.eds.variables):
        pytest.skip("no TPDO has a SYNC start value")


REMOTE = Situation(need_remote_frames, lambda pdo: pdo.configure(ON_REQUEST), _ask, _exactly(3))
EVENT = Situation(
    _no_demand,
    lambda pdo: pdo.configure(EVENT_DRIVEN, inhibit_100us=10 * INHIBIT_MS),
    _watch,
    _on_event,
)
TIMER = Situation(
    _no_demand, lambda pdo: pdo.configure(EVENT_DRIVEN, event_ms=EVENT_MS), _watch, _by_timer
)
CYCLIC = Situation(
    _consumes_sync,
    lambda pdo: pdo.configure(EVERY_SECOND),
    lambda device, can_id: _sync(device, None),
    _exactly(3),
)
ACYCLIC_SYNC = Situation(
    _consumes_sync,
    lambda pdo: pdo.configure(ACYCLIC),
    lambda device, can_id: _sync(device, None),
    _acyclic,
)
SYNC_COUNTER = Situation(
    _counts_sync,
    lambda pdo: pdo.configure(EVERY, sync_start=START_VALUE),
    lambda device, can_id: _sync(device, range(1, 6)),
    _exactly(3),
    OVERFLOW,
)
