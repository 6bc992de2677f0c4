"""The NMT slave, seen by a stock master (CiA 301 7.3.2)."""

import pytest
from device_master import NODE_ID, Master

HEARTBEAT = 0x700 + NODE_ID
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130


def test_boot_up_comes_by_itself(master: Master) -> None:
    """A device that is switched on announces itself before anything else."""
    assert [(f.can_id, f.data) for f in master.frames] == [(HEARTBEAT, b"\x00")]


def test_boot_up_leads_to_pre_operational(master: Master) -> None:
    """A stock master sees PRE-OPERATIONAL in the first heartbeat, unasked."""
    master.run(101)
    assert master.remote.nmt.state == "PRE-OPERATIONAL"
    assert master.data(HEARTBEAT)[-1] == bytes([127])


@pytest.mark.parametrize(("command", "state"), [(START, 5), (STOP, 4), (PRE_OPERATIONAL, 127)])
@pytest.mark.parametrize("address", [0, NODE_ID])
def test_commands_reach_the_node(master: Master, command: int, state: int, address: int) -> None:
    """The node obeys commands to itself and to all."""
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
