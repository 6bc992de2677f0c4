"""Heartbeat consumer: monitoring of other nodes, 0x1016 (CiA 301 7.5.2.19).

Each entry has a node-ID in bits 16 to 23 and a time in ms in bits 0 to 15. Monitoring of a node
starts with its first heartbeat or boot-up; no message during the time is the heartbeat event.
"""

from collections.abc import Callable
from typing import Any

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry
from hil_emulator.device.rpdo import NS_PER_MS

CONSUMER_HEARTBEAT_TIME = 0x1016
MAX_NODE_ID = 127


class HeartbeatConsumer:
    """Watches the heartbeats of other nodes.

    Args:
        dictionary: 0x1016 names the nodes.
        emergency: reports a lost node (0x8130, first manufacturer byte its node-ID).
        on_change: called when the monitored nodes have changed.

    Attributes:
        due_ns: earliest time at which a monitored node times out.

    """

    def __init__(
        self, dictionary: Dictionary, emergency: Emergency, on_change: Callable[[], None]
    ) -> None:
        self._emergency = emergency
        self._on_change = on_change
        fields = [dictionary.get(CONSUMER_HEARTBEAT_TIME, n) for n in range(1, 128)]
        self._entries = [field for field in fields if field is not None]
        dictionary.watch(CONSUMER_HEARTBEAT_TIME, self)
        self.reset()

    @property
    def node_ids(self) -> list[int]:
        """The monitored nodes."""
        return list(self._times_ns)

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: the timeout of a node is an event."""
        return self.due_ns

    def reset(self) -> None:
        """Read 0x1016 again; monitoring of every node starts with its next heartbeat."""
        self._times_ns = {
            node_id: time_ms * NS_PER_MS
            for node_id, time_ms in (_split(entry.value) for entry in self._entries)
            if _used(node_id, time_ms)
        }
        self._deadlines_ns: dict[int, int] = {}
        self.due_ns = NEVER

    def heard(self, now_ns: int, node_id: int) -> None:
        """Take note of a heartbeat."""
        self._emergency.clear(("heartbeat", node_id))
        self._deadlines_ns[node_id] = now_ns + self._times_ns[node_id]
        self.due_ns = min(self._deadlines_ns.values())

    def expired(self, now_ns: int) -> bool:
        """Return True once when nodes have timed out, and report these nodes."""
        if now_ns < self.due_ns:
            return False
        for node_id in [n for n, due_ns in self._deadlines_ns.items() if now_ns >= due_ns]:
            del self._deadlines_ns[node_id]
            self._emergency.raise_error(
                ("heartbeat", node_id),
                ErrorCode.LIFE_GUARD_OR_HEARTBEAT,
                ErrorBit.COMMUNICATION,
                bytes([node_id]),
            )
        self.due_ns = min(self._deadlines_ns.values(), default=NEVER)
        return True

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse to monitor a node twice (0604 0043)."""
        node_id, time_ms = _split(value)
        others = [_split(other.value) for other in self._entries if other is not entry]
        if _used(node_id, time_ms) and any(n == node_id and _used(n, t) for n, t in others):
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)

    def changed(self, entry: Entry) -> None:
        """Monitor the nodes that 0x1016 lists now."""
        for node_id in self._times_ns:
            self._emergency.clear(("heartbeat", node_id))
        self.reset()
        self._on_change()


def _split(value: int) -> tuple[int, int]:
    return value >> 16 & 0xFF, value & 0xFFFF


def _used(node_id: int, time_ms: int) -> bool:
    return 1 <= node_id <= MAX_NODE_ID and time_ms > 0
