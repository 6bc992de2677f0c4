"""Node and life guarding: the master polls by remote frame (CiA 301 7.2.8.3.2.1).

The node answers with its state and a bit that toggles from answer to answer. If 0x100C times
0x100D is not zero, a pause of that length between requests is a life guarding event. A node
with a heartbeat does not answer: CiA 301 allows one error control service at a time.
"""

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID, PRODUCER_HEARTBEAT_TIME
from hil_emulator.device.nmt import State
from hil_emulator.device.rpdo import NS_PER_MS
from hil_emulator.frame import Frame

GUARD_TIME = 0x100C
LIFE_TIME_FACTOR = 0x100D
_TOGGLE = 0x80
_LIFE_GUARDING = "life guarding"


class NodeGuarding:
    """Answers guarding requests and detects when they stop.

    Args:
        dictionary: 0x100C in ms, 0x100D and 0x1017.
        emergency: reports a lost master (0x8130).

    Attributes:
        requests: number of unanswered requests.
        due_ns: when the life time ends without a further request.

    """

    def __init__(self, dictionary: Dictionary, emergency: Emergency) -> None:
        self._dictionary = dictionary
        self._emergency = emergency
        self._guard = dictionary.get(GUARD_TIME)
        self._factor = dictionary.get(LIFE_TIME_FACTOR)
        self._heartbeat = dictionary.get(PRODUCER_HEARTBEAT_TIME)
        self.reset()

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: the timeout of the master is an event."""
        return self.due_ns

    def reset(self) -> None:
        """Restart after boot-up: the first answer has toggle 0, and monitoring is off."""
        self._toggle = 0
        self.requests = 0
        self.due_ns = NEVER

    def request(self, now_ns: int, data: bytes) -> None:
        """Handle a remote frame of the master."""
        if self._heartbeat is not None and self._heartbeat.value:
            return
        self.requests += 1
        self._emergency.clear(_LIFE_GUARDING)
        if self._guard is not None and self._factor is not None:
            life_time_ns = self._guard.value * self._factor.value * NS_PER_MS
            self.due_ns = now_ns + life_time_ns if life_time_ns else NEVER

    def expired(self, now_ns: int) -> bool:
        """Return True once when the life time has passed without a request."""
        if now_ns < self.due_ns:
            return False
        self.due_ns = NEVER
        self._emergency.raise_error(
            _LIFE_GUARDING, ErrorCode.LIFE_GUARD_OR_HEARTBEAT, ErrorBit.COMMUNICATION
        )
        return True

    def publish(self, state: State, frames: list[Frame]) -> None:
        """Append an answer to each request."""
        for _ in range(self.requests):
            can_id = ERROR_CONTROL_COB_ID + self._dictionary.node_id
            frames.append(Frame(can_id, bytes([state | self._toggle])))
            self._toggle ^= _TOGGLE
        self.requests = 0
