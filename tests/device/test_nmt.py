"""The NMT slave, seen by a stock master (CiA 301 7.3.2)."""

import pytest
from device_master import EMCY, HEARTBEAT, NODE_ID, SDO_ANSWER, SYNC, TPDO1, TPDO4, Master

from hil_emulator.frame import Frame

START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130


def test_boot_up_comes_by_itself(master: Master) -> None:
    """The first frame of a device that is switched on is the boot-up message."""
    assert [(f.can_id, f.data) for f in master.frames] == [(HEARTBEAT, b"\x00")]


def test_boot_up_leads_to_pre_operational(master: Master) -> None:
    """The first heartbeat after boot-up shows PRE-OPERATIONAL."""
    master.run(101)
    assert master.remote.nmt.state == "PRE-OPERATIONAL"
    assert master.data(HEARTBEAT)[-1] == bytes([127])


@pytest.mark.parametrize(("command", "state"), [(START, 5), (STOP, 4), (PRE_OPERATIONAL, 127)])
@pytest.mark.parametrize("address", [0, NODE_ID])
def test_commands_reach_the_node(master: Master, command: int, state: int, address: int) -> None:
    """The node executes commands to itself and to all nodes."""
    master.nmt(command, address)
    master.run(100)
    assert master.data(HEARTBEAT)[-1] == bytes([state])


@pytest.mark.parametrize(
    "data", [b"", b"\x01", bytes([1, NODE_ID, 0]), bytes([1, NODE_ID + 1]), bytes([3, NODE_ID])]
)
def test_other_nmt_messages_change_nothing(master: Master, data: bytes) -> None:
    """Wrong length, another node's address and unknown commands are ignored."""
    master.send(0x000, data)
    master.run(100)
    assert master.data(HEARTBEAT)[-1] == bytes([127])


def test_reset_node_reloads_everything(master: Master) -> None:
    """After reset node all objects have their defaults again, and boot-up follows."""
    master.remote.sdo["valve_current_safe"].raw = 7
    master.remote.sdo[0x1017].raw = 50
    master.forget()
    master.nmt(RESET_NODE)
    assert master.data(HEARTBEAT) == [b"\x00"]
    assert master.remote.sdo["valve_current_safe"].raw == 1_000_000
    assert master.remote.sdo[0x1017].raw == 100


def test_reset_communication_keeps_application_parameters(master: Master) -> None:
    """Reset communication restores the defaults of 0x1000 to 0x1FFF only."""
    master.remote.sdo["valve_current_safe"].raw = 7
    master.remote.sdo[0x1017].raw = 50
    master.forget()
    master.nmt(RESET_COMMUNICATION)
    assert master.data(HEARTBEAT) == [b"\x00"]
    assert master.remote.sdo["valve_current_safe"].raw == 7
    assert master.remote.sdo[0x1017].raw == 100


def test_reset_restores_pdo_parameters(master: Master) -> None:
    """A PDO switched off by SDO is back after reset communication."""
    master.remote.sdo[0x1800][1].raw = 0x80000000 | TPDO1
    master.nmt(RESET_COMMUNICATION)
    master.start()
    master.run(3)
    assert len(master.data(TPDO1)) == 3


def test_stopped_leaves_nmt_and_error_control_only(master: Master) -> None:
    """In STOPPED SDO, PDO and EMCY are off, and the heartbeat continues."""
    master.start()
    master.nmt(STOP)
    master.forget()
    master.measure(overrange=(1, 0, 0, 0, 0))
    master.send(SYNC)
    assert master.request("4000100000000000") == ""
    master.send(TPDO1, remote=True)
    master.run(200)
    assert {frame.can_id for frame in master.frames} == {HEARTBEAT}
    assert set(master.data(HEARTBEAT)) == {bytes([4])}


def test_emergency_of_stopped_is_sent_afterwards(master: Master) -> None:
    """An error in STOPPED is reported after the node has left STOPPED."""
    master.nmt(STOP)
    master.measure(overrange=(1, 0, 0, 0, 0))
    master.run(5)
    assert master.data(EMCY) == []
    master.nmt(PRE_OPERATIONAL)
    assert len(master.data(EMCY)) == 1


def test_pdos_are_active_in_operational_only(master: Master) -> None:
    """In PRE-OPERATIONAL no TPDO is sent, whether by timer, SYNC or remote frame."""
    master.send(SYNC)
    master.send(TPDO1, remote=True)
    master.run(20)
    assert master.data(TPDO1) == master.data(TPDO4) == []


def test_a_reset_drops_sdo_requests(master: Master) -> None:
    """A reset drops answers not yet sent."""
    request = bytes.fromhex("4000100000000000")
    master.network.tick(Frame(0x600 + NODE_ID, request), Frame(0, bytes([RESET_NODE, 0])))
    assert master.data(SDO_ANSWER) == []


def test_answers_not_sent_before_stopped_are_dropped(master: Master) -> None:
    """A request before STOPPED is not answered after the node has left STOPPED."""
    request = bytes.fromhex("4000100000000000")
    master.network.tick(Frame(0x600 + NODE_ID, request), Frame(0, bytes([STOP, 0])))
    master.nmt(PRE_OPERATIONAL)
    assert master.data(SDO_ANSWER) == []
