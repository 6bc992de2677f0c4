"""All PDOs of a node: who hears SYNC, who falls back, who sends."""

from collections.abc import Callable, Mapping, Sequence

from hil_emulator.device import pdo
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.entry import Entry
from hil_emulator.device.layout import checked_parameters
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.rpdo import NEVER, Handler, Rpdo
from hil_emulator.device.sensor_objects import SensorObjects
from hil_emulator.device.set_points import SetPoints
from hil_emulator.device.sync import SyncConsumer
from hil_emulator.device.tpdo import ALWAYS, Tpdo
from hil_emulator.device.trigger import Trigger
from hil_emulator.frame import Frame


class ProcessData:
    """The node's RPDOs and TPDOs; they live in OPERATIONAL only.

    Args:
        dictionary: the node's dictionary.
        emergency: told of PDO errors.
        set_points: told which of them an RPDO has lost.
        triggers: which changes are events of their own.
        on_written: told which objects an RPDO has written.
        on_change: called when parameters have changed, as frames may have to go elsewhere.

    Attributes:
        deadline_ns: before this time no RPDO is overdue.

    Raises:
        UserError: a default mapping is faulty.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        emergency: Emergency,
        set_points: SetPoints,
        triggers: Sequence[Trigger],
        on_written: Callable[[Sequence[Entry]], None],
        on_change: Callable[[], None],
    ) -> None:
        self._set_points = set_points
        self._triggers = triggers
        self._on_written = on_written
        self._on_change = on_change
        self.deadline_ns = NEVER
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

    def packed(self, sensors: SensorObjects, count: int) -> PackedTpdos | None:
        """Return the TPDOs as they are sent out of a record; None where they cannot be.

        Args:
            sensors: says what objects show.
            count: number of the last sample, as whoever samples counts them.

        """
        if any(t.on for t in self._triggers) or not all(t.repeats for t in self._active):
            return None
        ahead = sensors.number - count
        if self._packed is None or self._packed[0] != ahead:
            try:
                self._packed = ahead, PackedTpdos(self._active, sensors.shown_by(count))
            except LookupError:
                self._packed = ahead, None
        return self._packed[1]

    def shortcuts(self, otherwise: Mapping[int, Handler]) -> dict[int, Handler]:
        """Return what takes the frames of RPDOs while nothing is wrong, and no profile watches.

        Args:
            otherwise: takes those with which there is more to do, by identifier.

        """
        return {
            identifier: rpdo.shortcut(self._set_points.obeying, otherwise[identifier])
            for rpdo in self._active_rpdos
            if (identifier := rpdo.parameters.identifier) in otherwise
        }

    def sync_shortcut(self, length: int, otherwise: Handler) -> Handler:
        """Return what takes SYNC while nothing is wrong, and no RPDO waits for it.

        Args:
            length: how long SYNC is.
            otherwise: takes SYNC when there is more to do.

        """
        if self._synchronous_rpdos:
            return otherwise
        if not length and all(tpdo.every_sync for tpdo in self._synchronous):
            return _each_asked(self._synchronous, otherwise)
        told = [tpdo.sync for tpdo in self._synchronous]

        def take(now_ns: int, data: bytes) -> None:
            if len(data) != length:
                otherwise(now_ns, data)
                return
            counter = data[0] if data else 0
            for sync in told:
                sync(counter)

        return take

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

    def sync(self, now_ns: int, counter: int, consumer: SyncConsumer) -> None:
        """Apply held RPDOs and trigger synchronous TPDOs.

        Args:
            now_ns: time of the SYNC.
            counter: its counter, 0 without one.
            consumer: says how long synchronous RPDOs are taken from now on.

        """
        for rpdo in self._synchronous_rpdos:
            if rpdo.sync(now_ns, consumer.window_ns):
                self._on_written(rpdo.parameters.mapping.entries)
        for tpdo in self._synchronous:
            tpdo.sync(counter)

    def check_deadlines(self, now_ns: int) -> None:
        """Let the commands of each RPDO that is overdue fall back."""
        if now_ns < self.deadline_ns:
            return
        for rpdo in self._active_rpdos:
            if rpdo.expired(now_ns):
                self._set_points.fall_back(rpdo.parameters.mapping.entries)
        self.overdue(now_ns)

    def overdue(self, now_ns: int) -> bool:
        """Return whether an RPDO is overdue; see when one can be."""
        self.deadline_ns = min((r.deadline_ns for r in self._active_rpdos), default=NEVER)
        return now_ns >= self.deadline_ns

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
        """Add which data and remote frames the PDOs take."""
        for rpdo in self._active_rpdos:
            data.setdefault(rpdo.parameters.identifier, []).append(self._receiver(rpdo))
        for tpdo in self._active:
            remote.setdefault(tpdo.parameters.identifier, []).append(self._requester(tpdo))

    def _receiver(self, rpdo: Rpdo) -> Handler:
        entries = rpdo.parameters.mapping.entries

        def receive(now_ns: int, data: bytes) -> None:
            if rpdo.receive(now_ns, data):
                self._on_written(entries)
            if rpdo.deadline_ns < self.deadline_ns:
                self.deadline_ns = rpdo.deadline_ns

        return receive

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
        """Note who has something to do, of the many PDOs an EDS may describe."""
        self._packed = None
        self._active_rpdos = [rpdo for rpdo in self.rpdos if rpdo.parameters.active]
        self._synchronous_rpdos = [r for r in self._active_rpdos if r.parameters.synchronous]
        self._active = [tpdo for tpdo in self.tpdos if tpdo.parameters.active]
        self._synchronous = [tpdo for tpdo in self._active if tpdo.parameters.synchronous]


def _each_asked(tpdos: Sequence[Tpdo], otherwise: Handler) -> Handler:
    """Return what takes a SYNC without a counter, each of which triggers all TPDOs.

    It is `Tpdo.sync` of them, without its questions: this is part of most ticks.
    """

    def take(now_ns: int, data: bytes) -> None:
        if data:
            otherwise(now_ns, data)
            return
        for tpdo in tpdos:
            tpdo.requests += 1
            tpdo.wakes_ns = ALWAYS

    return take
