"""The NMT state machine against a table (CiA 301 7.3.2), command by command."""

from device_master import (
    CHANNELS,
    EDS,
    HEARTBEAT,
    NODE_ID,
    SDO_ANSWER,
    SDO_REQUEST,
    SYNC,
    TPDO4,
    Master,
    booted,
)
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

START, STOP, ENTER_PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130
STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127
NEXT = {
    START: OPERATIONAL,
    STOP: STOPPED,
    ENTER_PRE_OPERATIONAL: PRE_OPERATIONAL,
    RESET_NODE: PRE_OPERATIONAL,
    RESET_COMMUNICATION: PRE_OPERATIONAL,
}
NO_COMMANDS = (
    *(bytes([command]) for command in NEXT),
    *(bytes([command, NODE_ID, 0]) for command in NEXT),
    *(bytes([command, NODE_ID]) for command in (0, 3, 127, 131, 255)),
)
"""Too short, too long, unknown."""
SERVED = {
    "sdo": (PRE_OPERATIONAL, OPERATIONAL),
    "sync": (OPERATIONAL,),
}
"""States in which a service is answered (CiA 301 7.3.2.2)."""
COMMUNICATION, APPLICATION = (0x1029, 1), (0x2001, 0)
DEFAULT = 0


class NmtSlave(RuleBasedStateMachine):
    """A master that sends random commands and requests; the slave must follow the table."""

    def __init__(self) -> None:
        super().__init__()
        node = Node(Dictionary.from_eds(EDS, NODE_ID), CHANNELS, {"valve_current": 0.0})
        self.master: Master = booted(node)
        self.state = PRE_OPERATIONAL
        self.values = {COMMUNICATION: DEFAULT, APPLICATION: DEFAULT}
        self.lengths = {COMMUNICATION: 1, APPLICATION: 4}

    @rule(command=st.sampled_from(sorted(NEXT)), address=st.sampled_from([0, NODE_ID]))
    def command(self, command: int, address: int) -> None:
        """Send a command that concerns the slave."""
        self.master.forget()
        self.master.nmt(command, address)
        self.state = NEXT[command]
        reset = command in (RESET_NODE, RESET_COMMUNICATION)
        assert (self.master.data(HEARTBEAT)[:1] == [b"\0"]) == reset
        if reset:
            self.values[COMMUNICATION] = DEFAULT
        if command == RESET_NODE:
            self.values[APPLICATION] = DEFAULT

    @rule(command=st.integers(0, 255), address=st.integers(1, 127).filter(lambda n: n != NODE_ID))
    def command_to_another(self, command: int, address: int) -> None:
        """Send a command that concerns another node."""
        self.master.nmt(command, address)

    @rule(data=st.sampled_from(NO_COMMANDS) | st.binary(max_size=8).filter(lambda d: len(d) != 2))
    def command_nothing(self, data: bytes) -> None:
        """Send an invalid NMT command: unknown, or of another length."""
        self.master.send(0x000, data)

    @rule(command=st.sampled_from([RESET_NODE, RESET_COMMUNICATION]))
    def write_and_reset(self, command: int) -> None:
        """Change parameters, if the state allows it, and reset."""
        self.write(2, COMMUNICATION)
        self.write(2, APPLICATION)
        self.command(command, NODE_ID)

    @rule(value=st.sampled_from([1, 2]), key=st.sampled_from([COMMUNICATION, APPLICATION]))
    def write(self, value: int, key: tuple[int, int]) -> None:
        """Write a parameter; in STOPPED the write is ignored."""
        length = self.lengths[key]
        head = bytes([0x23 | 4 - length << 2]) + key[0].to_bytes(2, "little") + bytes([key[1]])
        self.master.send(SDO_REQUEST, head + value.to_bytes(4, "little"))
        if self.state in SERVED["sdo"]:
            self.values[key] = value

    @rule()
    def ask(self) -> None:
        """Read the device type."""
        self.master.forget()
        self.master.send(SDO_REQUEST, bytes.fromhex("4000100000000000"))
        assert len(self.master.data(SDO_ANSWER)) == (self.state in SERVED["sdo"])

    @rule()
    def sync(self) -> None:
        """Send SYNC."""
        self.master.forget()
        self.master.send(SYNC)
        assert len(self.master.data(TPDO4)) == (self.state in SERVED["sync"])

    @rule(milliseconds=st.integers(1, 350))
    def wait(self, milliseconds: int) -> None:
        """Advance the time; each heartbeat shows the state."""
        self.master.forget()
        self.master.run(milliseconds)
        beats = self.master.data(HEARTBEAT)
        assert set(beats) <= {bytes([self.state])}
        assert len(beats) in (milliseconds // 100, -(-milliseconds // 100))

    @invariant()
    def parameters_are_as_left(self) -> None:
        """Parameters change only by writes and resets that apply to them."""
        dictionary = self.master.network.node.dictionary
        assert {key: dictionary.read(*key) for key in self.values} == self.values

    @invariant()
    def process_data_is_for_operational(self) -> None:
        """Check that TPDOs are sent in each tick of OPERATIONAL, and in no other state."""
        self.master.forget()
        self.master.run(1)
        tpdos = [frame for frame in self.master.frames if frame.can_id == 0x180 + NODE_ID]
        assert bool(tpdos) == (self.state == OPERATIONAL)


TestNmtSlave = NmtSlave.TestCase
TestNmtSlave.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)
