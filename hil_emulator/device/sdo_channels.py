"""All SDO servers of a node: the default server and additional servers (CiA 301 7.5.2.33).

Each channel serves one client, independent of the others; all share one dictionary. A channel from
0x1201 on exists while bit 31 of both its COB-IDs is clear, and is off by default.
"""

from collections.abc import Callable
from operator import attrgetter
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.sdo import SDO_SERVER_PARAMETER, SdoServer
from hil_emulator.frame import Frame

MAX_CHANNELS = 128
CLIENT_TO_SERVER, SERVER_TO_CLIENT = 1, 2


def servers(dictionary: Dictionary) -> dict[int, SdoServer]:
    """Return an SDO server for each index that describes one, always including the default."""
    last = SDO_SERVER_PARAMETER + MAX_CHANNELS
    additional = [n for n in range(SDO_SERVER_PARAMETER + 1, last) if n in dictionary]
    return {index: SdoServer(dictionary, index) for index in (SDO_SERVER_PARAMETER, *additional)}


class SdoChannels:
    """The node's SDO servers.

    Args:
        dictionary: the objects; 0x1200 to 0x127F describe the channels.
        on_change: called when a channel is added, removed or has new identifiers.

    Attributes:
        busy: whether a transfer needs an answer or may time out.

    """

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._on_change = on_change
        self.busy = False
        self._servers = servers(dictionary)
        for index in self._servers:
            if index != SDO_SERVER_PARAMETER:
                dictionary.watch(index, self)

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: a transfer is answered and timed in each tick."""
        return NOW if self.busy else NEVER

    def reset(self) -> None:
        """Drop all transfers."""
        for server in self._servers.values():
            server.reset()

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append the answers of all channels."""
        for server in self._servers.values():
            server.publish(now_ns, frames)
        self.busy = any(server.busy for server in self._servers.values())

    def add_routes(self, routes: dict[int, list[Handler]]) -> None:
        """Add the handlers of the channels' frames."""
        for server in filter(attrgetter("exists"), self._servers.values()):
            routes.setdefault(server.request_can_id, []).append(self._receiver(server))

    def _receiver(self, server: SdoServer) -> Handler:
        def receive(now_ns: int, data: bytes) -> None:
            self.busy = True
            server.request(now_ns, data)

        return receive

    def check(self, entry: Entry, value: Any) -> None:
        """Lock the COB-IDs of an existing channel, and refuse bad identifiers (0609 0030)."""
        if entry.subindex in (CLIENT_TO_SERVER, SERVER_TO_CLIENT):
            cob_id.check_change(entry.value, value)

    def changed(self, entry: Entry) -> None:
        """Restart the changed channel."""
        self._servers[entry.index].reset()
        self._on_change()
