"""Chapters 9 and 10: NMT states and transitions (CiA 301 7.3.2)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.device import (
    COMMANDS,
    HEARTBEAT_PRODUCER,
    OPERATIONAL,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    SETTLE_MS,
    START,
    STOPPED,
    SYNC_COB_ID,
    Device,
)
from hil_emulator.conformance.pdo import TPDO_RECORDS, Pdo, usable
from hil_emulator.conformance.situations import EVERY, SYNC

EVERYBODY = 0
NMT_STARTUP, WAITS_FOR_MASTER = 0x1F80, 0x05
STATES = (PRE_OPERATIONAL, OPERATIONAL, STOPPED)


def synchronous_pdo(device: Device) -> int | None:
    """Enable only one TPDO, sent at every SYNC; return its identifier.

    Without a SYNC consumer or a TPDO the result is None, and only other services are checked.
    """
    if SYNC_COB_ID not in device.eds or not device.eds.indices(TPDO_RECORDS):
        return None
    pdo: Pdo = usable(device)[0]
    pdo.configure(EVERY)
    pdo.enable()
    return pdo.can_id


def check_sync(device: Device, can_id: int | None, *, answered: bool) -> None:
    """Check whether SYNC triggers the TPDO, if there is one."""
    if can_id is not None:
        assert answers_sync(device, can_id) == answered


def answers_sync(device: Device, can_id: int) -> bool:
    """Return whether SYNC triggers the TPDO."""
    since = len(device.wire.log)
    device.wire.send(SYNC)
    return device.wire.await_frame(can_id, since=since, patience_ms=SETTLE_MS) is not None


def check_state(device: Device, state: int) -> None:
    """Check the state by heartbeat, else by guarding, else by the services."""
    if device.watch_state():
        device.expect_state(state)
    elif device.wire.remote_frames and device.guard() is not None:
        assert device.guarded_state() == state
    assert device.answers() == (state != STOPPED)


def check_reachable(device: Device, target: int) -> None:
    """Check that a command, to the node or to all nodes, leads to `target` from every state."""
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 20, 2)
    for origin in STATES:
        for address in (device.node_id, EVERYBODY):
            device.enter(origin)
            device.nmt(COMMANDS[target], address)
            check_state(device, target)
            device.enter(PRE_OPERATIONAL)


@case("9.1")
def test_boot_up_comes_with_defaults(device: Device) -> None:
    """After reset node a boot-up message is sent, and parameters have their defaults."""
    key = HEARTBEAT_PRODUCER, 0
    if device.eds.writable(*key):
        device.sdo.write(*key, 777, 2)
    device.reset(RESET_NODE)
    if device.eds.writable(*key):
        assert device.sdo.upload(*key) == device.eds.default(device.eds.variables[key])


@case("9.2")
def test_pre_operational_follows_boot_up(device: Device, request: pytest.FixtureRequest) -> None:
    """After boot-up, without a command, the state is PRE-OPERATIONAL: SDO works, SYNC does not.

    OPERATIONAL is accepted for a self-starting device by 0x1F80 (CiA 302-2) or `--self-starting`.
    """
    if device.self_starting:
        assert request.config.getoption("--self-starting") or _may_start(device), (
            "OPERATIONAL after boot-up, without 0x1F80; --self-starting would accept it"
        )
        return
    can_id = synchronous_pdo(device)
    check_state(device, PRE_OPERATIONAL)
    check_sync(device, can_id, answered=False)
    boots = [data for data in device.wire.heard(device.error_control_id) if data == b"\0"]
    assert boots == [], "a second boot-up message"


@case("9.3")
def test_operational_serves_everything(device: Device) -> None:
    """In OPERATIONAL SDO and SYNC are answered."""
    can_id = synchronous_pdo(device)
    device.enter(OPERATIONAL)
    check_state(device, OPERATIONAL)
    check_sync(device, can_id, answered=True)


@case("9.4")
def test_stopped_serves_error_control_alone(device: Device) -> None:
    """In STOPPED neither SDO nor SYNC is answered, and only error control is sent."""
    can_id = synchronous_pdo(device)
    device.enter(OPERATIONAL)
    device.enter(STOPPED)
    since = len(device.wire.log)
    check_state(device, STOPPED)
    check_sync(device, can_id, answered=False)
    sent = {
        frame.can_id for _, frame in device.wire.log[since:] if _of_device(device, frame.can_id)
    }
    assert sent <= {device.error_control_id}


@case("10.1")
def test_reset_from_every_state(device: Device) -> None:
    """Both resets, to the node or to all nodes, lead to a boot-up message and PRE-OPERATIONAL."""
    for command in (RESET_NODE, RESET_COMMUNICATION):
        for origin in STATES:
            for address in (device.node_id, EVERYBODY):
                device.enter(origin)
                device.reset(command, address)
                check_state(device, PRE_OPERATIONAL)


@case("10.2")
def test_pre_operational_from_every_state(device: Device) -> None:
    """Enter PRE-OPERATIONAL is executed in every state."""
    check_reachable(device, PRE_OPERATIONAL)


@case("10.3")
def test_operational_from_every_state(device: Device) -> None:
    """Start is executed in every state; a start to another node is ignored."""
    device.nmt(START, device.node_id % 127 + 1)
    check_state(device, PRE_OPERATIONAL)
    check_reachable(device, OPERATIONAL)


@case("10.4")
def test_stopped_from_every_state(device: Device) -> None:
    """Stop is executed in every state."""
    check_reachable(device, STOPPED)


def _may_start(device: Device) -> bool:
    """Return whether 0x1F80 allows a self-start: not an NMT master, and bit 2 clear."""
    return NMT_STARTUP in device.eds and not device.sdo.read(NMT_STARTUP) & WAITS_FOR_MASTER


def _of_device(device: Device, can_id: int) -> bool:
    """Return whether an identifier belongs to the device in the predefined connection set."""
    return can_id & 0x7F == device.node_id
