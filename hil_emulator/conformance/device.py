"""The device under test: EDS, SDO client, NMT commands and states."""

from hil_emulator.conformance.expectation import Expectation
from hil_emulator.conformance.sdo_client import SdoClient
from hil_emulator.conformance.wire import Wire

START, STOP, ENTER_PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130
STOPPED, OPERATIONAL, PRE_OPERATIONAL = 4, 5, 127
"""NMT commands and states (CiA 301 7.2.8.2.1, 7.2.8.3.2)."""

COMMANDS = {OPERATIONAL: START, STOPPED: STOP, PRE_OPERATIONAL: ENTER_PRE_OPERATIONAL}

SAVE, LOAD = b"save", b"load"
STORE_PARAMETERS, RESTORE_PARAMETERS = 0x1010, 0x1011
SYNC_COB_ID, SYNC_OVERFLOW, CYCLE_PERIOD = 0x1005, 0x1019, 0x1006
SYNC_PRODUCER = 1 << 30
EMCY_COB_ID = 0x1014
GUARD_TIME, LIFE_TIME_FACTOR = 0x100C, 0x100D
HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER = 0x1016, 0x1017

BOOT_MS = 15_000
"""Longest time for a boot (assumed)."""
SETTLE_MS = 200
"""Longest time for an unconfirmed action (assumed)."""
_HEARTBEAT_MS = 20


class Device:
    """The device under test.

    Args:
        wire: the suite's connection to the bus.
        node_id: 1 to 127.
        eds: content of the EDS.

    Attributes:
        sdo: a client of its SDO server.
        error_control_id: identifier of boot-up, heartbeat and guarding.
        self_starting: whether it enters OPERATIONAL after boot-up, without a master (0x1F80).

    """

    def __init__(self, wire: Wire, node_id: int, eds: Expectation) -> None:
        self.wire = wire
        self.node_id = node_id
        self.eds = eds
        self.error_control_id = 0x700 + node_id
        self.sdo = SdoClient(wire, 0x600 + node_id, 0x580 + node_id)
        self.self_starting = False

    # -- NMT ------------------------------------------------------------------------------

    def nmt(self, command: int, address: int | None = None) -> None:
        """Send an NMT command, to this device unless an address is given."""
        target = self.node_id if address is None else address
        self.wire.send(0x000, bytes([command, target]))

    def reset(self, command: int = RESET_NODE, address: int | None = None) -> None:
        """Reset the device, wait until it has booted, and enter PRE-OPERATIONAL."""
        self.boot(command, address)
        if self.self_starting:
            self.enter(PRE_OPERATIONAL)

    def boot(self, command: int = RESET_NODE, address: int | None = None) -> None:
        """Reset the device and wait until it has booted."""
        assert self.boots(command, address), f"no boot-up message after NMT command {command}"

    def boots(self, command: int = RESET_NODE, address: int | None = None) -> bool:
        """Reset the device; return whether a boot-up message follows."""
        since = len(self.wire.log)
        self.nmt(command, address)
        booted = self.wire.await_frame(
            self.error_control_id, lambda data: data == b"\0", since=since, patience_ms=BOOT_MS
        )
        return booted is not None

    def answers(self) -> bool:
        """Return whether the device answers a read of the device type."""
        since = self.sdo.send(b"\x40\x00\x10\x00")
        answer_id = 0x580 + self.node_id
        return self.wire.await_frame(answer_id, since=since, patience_ms=SETTLE_MS) is not None

    def enter(self, state: int, address: int | None = None) -> None:
        """Bring the device into an NMT state and wait until it has reached the state."""
        watched = self.watch_state() if state == STOPPED else False
        self.nmt(COMMANDS[state], address)
        if state != STOPPED:
            self.sdo.upload(0x1000)  # answered after the command was executed
        elif watched:
            self.expect_state(STOPPED)
        else:
            self.wire.run(SETTLE_MS)

    def expect_state(self, state: int) -> None:
        """Wait for a heartbeat that shows a state; the device must be sending heartbeats."""
        since = len(self.wire.log)
        shown = self.wire.await_frame(
            self.error_control_id, lambda data: data == bytes([state]), since=since
        )
        heard = [data.hex() for data in self.wire.heard(self.error_control_id, since)]
        assert shown is not None, f"no heartbeat showed state {state}, but {heard}"

    def guarded_state(self) -> int:
        """Return the NMT state, by guarding."""
        data = self.guard()
        assert data is not None, "no answer to a guarding request"
        return data[0] & 0x7F

    def guard(self, patience_ms: float = SETTLE_MS * 10) -> bytes | None:
        """Send a guarding request and return the answer."""
        since = len(self.wire.log)
        self.wire.send(self.error_control_id, remote=True)
        return self.wire.await_frame(self.error_control_id, since=since, patience_ms=patience_ms)

    def state_after_boot(self) -> int:
        """Return the device's state, by heartbeat or guarding; 0 without error control."""
        self.wire.run(SETTLE_MS)
        if self.watch_state():
            since = len(self.wire.log)
            data = self.wire.await_frame(self.error_control_id, since=since)
        else:
            data = self.guard() if self.wire.remote_frames else None
        return data[0] & 0x7F if data else 0

    def watch_state(self) -> bool:
        """Switch heartbeats on, if the device answers SDO; return whether it has heartbeats."""
        if not self.eds.writable(HEARTBEAT_PRODUCER):
            return False
        since = len(self.wire.log)
        request = b"\x2b\x17\x10\x00" + _HEARTBEAT_MS.to_bytes(2, "little")
        self.sdo.send(request)  # in STOPPED there is no answer, and the time is unchanged
        self.wire.await_frame(0x580 + self.node_id, since=since, patience_ms=SETTLE_MS)
        return True

    # -- parameters -----------------------------------------------------------------------

    def restore_defaults(self) -> None:
        """Restore the defaults, if the device supports it, and reset the device."""
        if self.eds.writable(RESTORE_PARAMETERS, 1):
            self.sdo.write_code(RESTORE_PARAMETERS, 1, LOAD)
        self.reset()

    def prepare_sync(self, overflow: int = 0) -> None:
        """Stop the SYNC producer, and set the counter overflow (0 is no counter)."""
        self.stop_sync()
        if self.eds.writable(SYNC_OVERFLOW):
            self.sdo.write(SYNC_OVERFLOW, 0, overflow, 1)

    def stop_sync(self) -> None:
        """Stop the SYNC producer, so that its parameters can be written."""
        if self.eds.writable(SYNC_COB_ID):
            cob_id = self.sdo.read(SYNC_COB_ID)
            if cob_id & SYNC_PRODUCER:
                self.sdo.write(SYNC_COB_ID, 0, cob_id & ~SYNC_PRODUCER, 4)
        if self.eds.writable(CYCLE_PERIOD):
            self.sdo.write(CYCLE_PERIOD, 0, 0, 4)

    # -- EMCY and SYNC --------------------------------------------------------------------

    @property
    def emergency_id(self) -> int:
        """Identifier of emergencies by the EDS, else that of the predefined connection set."""
        variable = self.eds.variables.get((EMCY_COB_ID, 0))
        can_id = 0 if variable is None else variable.default & 0x7FF
        return can_id or 0x080 + self.node_id

    def emergencies(self, since: int = 0) -> list[int]:
        """Return the error codes of all emergencies in the log, without code 0 (no error)."""
        heard = self.wire.heard(self.emergency_id, since)
        return [code for data in heard if (code := int.from_bytes(data[:2], "little"))]

    def await_emergency(self, code: int, since: int) -> bytes | None:
        """Return the first emergency with a code, from the log or later; code 0 is no error."""
        return self.wire.await_frame(
            self.emergency_id,
            lambda data: int.from_bytes(data[:2], "little") == code,
            since=since,
        )

    def sync(self, counter: int | None = None, can_id: int = 0x080) -> None:
        """Send a SYNC and wait until the device has handled it."""
        self.wire.send(can_id, b"" if counter is None else bytes([counter]))
        self.barrier()

    def barrier(self) -> None:
        """Wait until the device has handled and answered all frames sent to it."""
        self.sdo.upload(0x1000)
