"""A node that a DBC describes, as the rig sees it."""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from hil_emulator.device.deadline import NOW
from hil_emulator.device.measured import Measured
from hil_emulator.frame import Frame

# imported for types only: cantools takes half a second, and most rigs have no partner
if TYPE_CHECKING:
    from hil_emulator.partners.commands import ObeyedMessage
    from hil_emulator.partners.sent_message import SentMessage

STANDARD_ID = 0x7FF


class NoFastPath:
    """A partner's messages are packed in each tick: see `device/fast_path.py`."""

    until_ns = NOW
    on = False


class Partner:
    """Sends and obeys the messages of a DBC.

    Args:
        name: for messages to the user.
        sent: what it sends.
        obeyed: what it obeys.

    Attributes:
        on_route: as of `Node`; what a partner hears does not change.

    """

    hears: Mapping[int, bool] = {}
    asked: frozenset[int] = frozenset()

    def __init__(
        self, name: str, sent: "Sequence[SentMessage]", obeyed: "Sequence[ObeyedMessage]"
    ) -> None:
        self.name = name
        self.on_route: Callable[[], None] = lambda: None
        self.fast_path = NoFastPath()
        self.sent = sent
        self.obeyed = obeyed

    def receive(self, now_ns: int, frames: Iterable[Frame]) -> Mapping[str, float]:
        """Take frames; return the value in SI of every command in force."""
        for frame in frames:
            if not frame.remote:
                self.take(now_ns, frame)
        commands: dict[str, float] = {}
        for message in self.obeyed:
            message.check(now_ns)
            commands |= message.commands
        return commands

    def take(self, now_ns: int, frame: Frame) -> None:
        """Take one data frame."""
        for obeyed in self.obeyed:
            message = obeyed.message
            if (message.frame_id, message.is_extended_frame) == (frame.can_id, frame.extended):
                obeyed.receive(now_ns, frame.data)

    def publish(self, now_ns: int, measured: Measured) -> list[Frame]:
        """Return the frames due with a sample."""
        frames = []
        for message in self.sent:
            data = message.due(now_ns, measured)
            if data is not None:
                frames += self.frames(now_ns, message, data)
        return frames

    def frames(self, now_ns: int, sent: "SentMessage", data: bytes) -> list[Frame]:
        """Return the frames that carry a message."""
        return [Frame(sent.message.frame_id, data, False, sent.message.is_extended_frame)]

    # -- events of a bus with modelled timing, as for `Node`; a DBC has no objects for them -----

    def bus_off(self) -> None:
        """Do nothing: a DBC defines no reaction."""

    def raise_error(self, key: Hashable, code: int, bit: int) -> None:
        """Report nothing: emergencies are CANopen's."""

    def clear_error(self, key: Hashable) -> None:
        """Report nothing."""
