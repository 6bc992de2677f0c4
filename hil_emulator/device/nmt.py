"""NMT: the states of a node, and the commands that change them (CiA 301 7.3.2)."""

from enum import IntEnum

NMT_COB_ID = 0x000
BROADCAST = 0


class State(IntEnum):
    """NMT state, with the number a heartbeat carries (CiA 301 7.2.8.3.2.2)."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class Command(IntEnum):
    """NMT command specifier (CiA 301 7.2.8.2.1)."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


NEXT_STATE = {
    Command.START: State.OPERATIONAL,
    Command.STOP: State.STOPPED,
    Command.ENTER_PRE_OPERATIONAL: State.PRE_OPERATIONAL,
    Command.RESET_NODE: State.INITIALISING,
    Command.RESET_COMMUNICATION: State.INITIALISING,
}


ERROR_BEHAVIOUR = 0x1029
COMMUNICATION_ERROR = 1
"""Sub-index of 0x1029 for bus-off, a lost heartbeat or a lost master."""


NMT_STARTUP = 0x1F80
NMT_MASTER, NOT_SELF_STARTING = 0x01, 0x04
"""Bits of 0x1F80 (CiA 302-2): the device is the master; a slave waits for its master to start."""


class ErrorBehaviour(IntEnum):
    """Where the node goes after a serious error (CiA 301 7.5.2.32)."""

    PRE_OPERATIONAL = 0
    NO_CHANGE = 1
    STOPPED = 2


def parse(data: bytes, node_id: int) -> Command | None:
    """Return the command meant for this node, or None for any other or malformed message."""
    if len(data) != 2 or data[1] not in (BROADCAST, node_id):
        return None
    try:
        return Command(data[0])
    except ValueError:
        return None
