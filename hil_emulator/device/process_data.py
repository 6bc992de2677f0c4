"""All PDOs of a node: SYNC, deadlines and transmission."""

from collections.abc import Callable, Sequence

from hil_emulator.device import pdo
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.entry import Entry
from hil_emulator.device.layout import checked_parameters
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.rpdo import Handler, Rpdo
from hil_emulator.device.sensor_objects import SensorObjects
from hil_emulator.device.set_points import SetPoints
from hil_emulator.device.sync import SyncConsumer
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.device.trigger import Trigger
from hil_emulator.frame import Frame


class ProcessData:
    """The node's RPDOs and TPDOs; they are active in OPERATIONAL only.

    Args:
        dictionary: the node's dictionary.
        emergency: reports PDO errors.
        set_points: fall back to safe values after a missed deadline.
        consumer: holds the time window for synchronous RPDOs.
        triggers: decide which changes are events.
        on_written: called with the objects that an RPDO has written; None without a profile.
        on_change: called when parameters have changed, so that routes are rebuilt.

    Attributes:
        deadline_ns: earliest time at which an RPDO is overdue.
        before_event: called before an RPDO changes other objects than set points, or makes
            `deadline_ns` earlier.

    Raises:
        UserError: a default mapping is faulty.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        emergency: Emergency,
        set_points: SetPoints,
        consumer: SyncConsumer,
        triggers: Sequence[Trigger],
        on_written: Callable[[Sequence[Entry]], None] | None,
        on_change: Callable[[], None],
    ) -> None:
        self._set_points = set_points
        self._consumer = consumer
        self._triggers = triggers
        self._on_written = on_written
        self._on_change = on_change
        self.deadline_ns = NEVER
        self.before_event: Callable[[], None] = lambda: None
        self._active: list[Tpdo] = []
        self._packed: tuple[int, PackedTpdos | None] | None = None
        self.rpdos: list[Rpdo] = []
        self.tpdos: list[Tpdo] = []
        for number in pdo.numbers(dictionary, receive=True):
            rpdo = Rpdo(checked_parameters(dictionary, number, receive=True), emergency)
            rpdo.parameters.on_change = self._restarter(rpdo)
            self.rpdos.append(rpdo)
        for number in pdo.numbers(dictionary, receive=False):
            tpdo = Tpdo(checked_parameters(dictionary, number, receive=False))
            tpdo.parameters.on_change = self._restarter(tpdo)
            self.tpdos.append(tpdo)
        self._select()

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: earliest deadline of an RPDO; TPDOs with events need each tick."""
        if any(t.on for t in self._triggers) or not all(t.repeats for t in self._active):
            return NOW
        self.deadline_ns = self._earliest_deadline()
        return self.deadline_ns

    def packed(self, sensors: SensorObjects, count: int) -> PackedTpdos | None:
        """Return the TPDOs packed for the fast path; None if that is not possible.

        Args:
            sensors: holds the content of the objects.
            count: number of the last sample, as counted by the caller.

        """
        ahead = sensors.number - count
        if self._packed is None or self._packed[0] != ahead:
            try:
                self._packed = ahead, PackedTpdos(self._active, sensors.shown_by(count))
            except LookupError:
                self._packed = ahead, None
        return self._packed[1]

    @property
    def all(self) -> list[Rpdo | Tpdo]:
        """RPDOs and TPDOs by number, RPDOs first."""
        return [*self.rpdos, *self.tpdos]

    def start(self) -> None:
        """Enter OPERATIONAL."""
        self._packed = None
        for item in self.all:
            item.start()

    def stop(self) -> None:
        """Leave OPERATIONAL: every command falls back to its safe value."""
        for rpdo in self.rpdos:
            rpdo.stop()
        self._set_points.fall_back()

    def reload(self) -> None:
        """Take over the parameters a reset has put into the dictionary."""
        for item in self.all:
            item.parameters.load()
        self._select()

    def sync_handler(self) -> Handler:
        """Return the handler of SYNC in OPERATIONAL."""
        others = self._synchronous_rpdos or self._synchronous
        return self._consumer.handler(self._at_every_sync, self._sync if others else None)

    def _sync(self, now_ns: int, counter: int) -> None:
        """Apply held RPDOs and trigger the TPDOs that are not sent at every SYNC.

        Args:
            now_ns: time of the SYNC.
            counter: its counter, 0 without one.

        """
        for rpdo in self._synchronous_rpdos:
            if rpdo.sync(now_ns, self._consumer.window_ns):
                self._written(rpdo.parameters.mapping.entries)
        for tpdo in self._synchronous:
            tpdo.sync(counter)

    def check_deadlines(self, now_ns: int) -> None:
        """Apply the safe values of the commands of each overdue RPDO."""
        if now_ns < self.deadline_ns:
            return
        for rpdo in self._active_rpdos:
            if rpdo.expired(now_ns):
                self._set_points.fall_back(rpdo.parameters.mapping.entries)
        self.deadline_ns = self._earliest_deadline()

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append the TPDOs due now, by number."""
        for trigger in self._triggers:
            if trigger.on and trigger.fires():
                for tpdo in self._active:
                    tpdo.trigger(trigger.entries)
        for tpdo in self._active:
            if now_ns >= tpdo.wakes_ns:
                tpdo.publish(now_ns, frames)

    def add_routes(self, data: dict[int, list[Handler]], remote: dict[int, list[Handler]]) -> None:
        """Add the handlers of the PDOs' data and remote frames."""
        for rpdo in self._active_rpdos:
            data.setdefault(rpdo.parameters.identifier, []).append(self._receiver(rpdo))
        for tpdo in self._active:
            remote.setdefault(tpdo.parameters.identifier, []).append(self._requester(tpdo))

    def _earliest_deadline(self) -> int:
        return min((r.deadline_ns for r in self._active_rpdos), default=NEVER)

    def _receiver(self, rpdo: Rpdo) -> Handler:
        entries = rpdo.parameters.mapping.entries
        set_points_alone = self._set_points.includes(entries)

        def receive(now_ns: int, data: bytes) -> None:
            if not set_points_alone:
                self.before_event()
            if rpdo.receive(now_ns, data):
                self._written(entries)
            if rpdo.deadline_ns < self.deadline_ns:
                self.before_event()
                self.deadline_ns = rpdo.deadline_ns

        several = rpdo.parameters.synchronous or len(entries) != 1
        if self._on_written or several or not set_points_alone:
            return receive
        return rpdo.handler(self._set_points.obeying(entries[0]), receive)

    def _written(self, entries: Sequence[Entry]) -> None:
        self._set_points.written(entries)
        if self._on_written:
            self._on_written(entries)

    @staticmethod
    def _requester(tpdo: Tpdo) -> Handler:
        def request(now_ns: int, data: bytes) -> None:
            tpdo.request()

        return request

    def _restarter(self, item: Rpdo | Tpdo) -> Callable[[], None]:
        def restart() -> None:
            item.start()
            self._select()
            self._on_change()

        return restart

    def _select(self) -> None:
        """Select the active PDOs of the many that an EDS may describe."""
        self._packed = None
        self._active_rpdos = [rpdo for rpdo in self.rpdos if rpdo.parameters.active]
        self._synchronous_rpdos = [r for r in self._active_rpdos if r.parameters.synchronous]
        self._active = [tpdo for tpdo in self.tpdos if tpdo.parameters.active]
        synchronous = [tpdo for tpdo in self._active if tpdo.parameters.synchronous]
        self._at_every_sync = [tpdo for tpdo in synchronous if tpdo.at_every_sync]
        self._synchronous = [tpdo for tpdo in synchronous if not tpdo.at_every_sync]
