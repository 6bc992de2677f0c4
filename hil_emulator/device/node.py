"""The CANopen node: the services of CiA 301 around one dictionary.

The order of a tick is the contract with the rig: `receive` all frames, move the plant, `publish`
its sample. Within `publish` frames come in this order, which is nearly that of their priority on a
bus with the predefined connection set: SYNC, TIME, EMCY, TPDOs by number, SDO answers, error
control.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

from hil_emulator.device import bus_load, layout, nmt
from hil_emulator.device.binding import SensorObjects, SetPoints
from hil_emulator.device.course import Course, Courses
from hil_emulator.device.dictionary import (
    ALL_OBJECTS,
    COMMUNICATION_OBJECTS,
    UNCONFIGURED,
    Dictionary,
)
from hil_emulator.device.distortion import Distortion
from hil_emulator.device.emergency import Emergency, ErrorBit
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import (
    ERROR_CONTROL_COB_ID,
    PRODUCER_HEARTBEAT_TIME,
    Heartbeat,
)
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.lss import LSS_REQUEST, LssSlave
from hil_emulator.device.measured import Measured
from hil_emulator.device.nmt import (
    COMMUNICATION_ERROR,
    ERROR_BEHAVIOUR,
    NMT_MASTER,
    NMT_STARTUP,
    NOT_SELF_STARTING,
    Command,
    ErrorBehaviour,
    State,
)
from hil_emulator.device.node_guarding import NodeGuarding
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.profiles.choice import profile_of
from hil_emulator.device.program_download import ProgramDownload
from hil_emulator.device.rest import Rest, Routes, Sampled, routes_at_rest, waking
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.sdo_channels import SdoChannels
from hil_emulator.device.storage import MemoryStorage, ParameterStore, Storage
from hil_emulator.device.sync import SyncConsumer, SyncProducer
from hil_emulator.device.time_stamp import TimeStamp
from hil_emulator.device.trigger import Trigger
from hil_emulator.device.verify_configuration import VerifyConfiguration
from hil_emulator.frame import EXTENDED, Frame


class Node:
    """A CiA 301 slave: frames, samples and the time in; frames and commands out.

    The first `publish` sends the boot-up message and enters PRE-OPERATIONAL.

    Args:
        dictionary: the node's dictionary; the node owns it from here on.
        channels: names of the sensor channels; an object of the same name shows the channel.
        commands: safe value in SI of each command the plant understands; the object of the
            same name is its set point.
        storage: where parameters saved by 0x1010 are kept; in memory by default.
        courses: objects that follow a course over time.
        autostart: whether it enters OPERATIONAL by itself; None leaves it to 0x1F80.

    Attributes:
        dictionary: as given.
        hears: the identifier of every data frame that the node takes in its present state, with
            bit 29 set for one of 29 bits, and whether taking it may change what the node takes.
        asked: the identifiers of the remote frames that it takes.
        on_route: called when these have changed.
        rest: whether and until when the node rests.
        repeat: while it rests, what `publish` is else: takes time and record, returns frames.
        distortions: what is wrong with its objects at present.

    Raises:
        UserError: a command has no RPDO-mappable object, or a default PDO maps what does not exist
            or cannot be mapped.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        channels: Sequence[str],
        commands: Mapping[str, float],
        storage: Storage | None = None,
        courses: Sequence[tuple[Entry, Course]] = (),
        autostart: bool | None = None,
    ) -> None:
        self.dictionary = dictionary
        self.on_route: Callable[[], None] = lambda: None
        self.distortions: list[Distortion] = []
        storage = storage or MemoryStorage()
        self._lss = LssSlave(dictionary, storage, self._configured)
        if self._lss.node_id != UNCONFIGURED:
            dictionary.renumber(self._lss.node_id)
        self._state = State.INITIALISING
        self._emergency = Emergency(dictionary)
        self._profile = profile_of(dictionary, channels, self._emergency)
        claimed = self._profile.sources
        self._sensors = SensorObjects(dictionary, channels, self._emergency, claimed)
        self._set_points = SetPoints(dictionary, commands)
        self._courses = Courses(courses)
        self._autostart = autostart
        self._sources = {
            **self._sensors.sources,
            **self._set_points.sources,
            **claimed,
            **self._courses.sources,
        }
        self._store = ParameterStore(dictionary, storage)
        self._store.reset(ALL_OBJECTS)
        self._set_points.fall_back()
        self._profile.reset()
        self._sdo = SdoChannels(dictionary, self._route)
        self._heartbeat = Heartbeat(dictionary)
        self._guarding = NodeGuarding(dictionary, self._emergency)
        self._consumer = HeartbeatConsumer(dictionary, self._emergency, self._route)
        self._sync = SyncConsumer(dictionary, self._emergency, self._route)
        self._sync_producer = SyncProducer(dictionary)
        self._time = TimeStamp(dictionary, self._route)
        VerifyConfiguration(dictionary)
        self._programs = ProgramDownload(dictionary)
        triggers = [Trigger(entry, delta=entry.delta) for entry in dictionary if entry.delta]
        self._pdos = ProcessData(
            dictionary,
            self._emergency,
            self._set_points,
            [*self._profile.triggers, *triggers],
            self._on_written,
            self._route,
        )
        self.rest = Rest(self._sensors, self._pdos)
        self.repeat: Callable[[int, bytearray], Sequence[Frame]]
        self._resting_routes: tuple[Routes, Routes] | None = None
        self._route()
        dictionary.before_write = self._before_write

    @property
    def node_id(self) -> int:
        """The node-ID, 1 to 127; LSS may change it."""
        return self.dictionary.node_id

    @property
    def state(self) -> State:
        """The NMT state."""
        return self._state

    def receive(self, now_ns: int, frames: Iterable[Frame]) -> Mapping[str, float]:
        """Take all frames the bus carried since the last tick.

        Args:
            now_ns: time of this tick, not before that of the last.
            frames: in the order of their arrival; any frame is allowed.

        Returns:
            The value in SI of every command, in force from now on.

        """
        for can_id, data, remote, extended in frames:
            routes = self._remote_routes if remote else self._routes
            handler = routes.get(can_id | EXTENDED if extended else can_id)
            if handler is not None:
                handler(now_ns, data)
        if self.rest.on:
            due = now_ns >= self.rest.until_ns
            if not due and (now_ns < self._pdos.deadline_ns or not self._pdos.overdue(now_ns)):
                if self._set_points.stale:
                    self._set_points.update(operational=True)
                return self._set_points.commands
            self.attend()
        if now_ns >= self._consumer.due_ns or now_ns >= self._guarding.due_ns:
            self._check_partners(now_ns)
        operational = self._state is State.OPERATIONAL
        if operational:
            self._pdos.check_deadlines(now_ns)
        if self._set_points.stale:
            self._set_points.update(operational=operational)
        return self._profile.command(now_ns, self._set_points.commands, operational=operational)

    def publish(self, now_ns: int, measured: Measured) -> list[Frame]:
        """Show the tick's sample and return the frames due, in the order they are to be sent.

        Args:
            now_ns: the same time `receive` got.
            measured: one value per channel, in the order of the channels' names. The sample
                of the last tick, the same object, may be published again: it is no new one.

        """
        if self.rest.on:
            self.attend()
        if self._sensors.sample(now_ns, measured):
            self._profile.measure(now_ns, measured)
        if self._courses.sources:
            self._courses.publish(now_ns)
        for distortion in self.distortions:
            distortion.publish(now_ns)
        frames: list[Frame] = []
        if self._lss.answers:
            self._lss.publish(frames)
        if self._state is State.INITIALISING:
            if self._lss.node_id != UNCONFIGURED:
                frames.append(self._heartbeat.boot_up(now_ns))
                self._enter(State.PRE_OPERATIONAL)
                if self._self_starting():
                    self._enter(State.OPERATIONAL)
            return frames
        if measured.overrange != self._sensors.overrange:
            self._sensors.check_ranges(measured.overrange)
        if self._state is not State.STOPPED:
            if self._produces:
                self._produce(now_ns, frames)
            if self._emergency.queue:
                self._emergency.publish(now_ns, frames)
            if self._state is State.OPERATIONAL:
                self._pdos.publish(now_ns, frames)
            if self._sdo.busy:
                self._sdo.publish(now_ns, frames)
        if self._guarding.requests:
            self._guarding.publish(self._state, frames)
        if now_ns >= self._heartbeat.due_ns:
            self._heartbeat.publish(now_ns, self._state, frames)
        return frames

    # -- at rest: somebody else packs what the TPDOs carry ----------------------------------

    @property
    def may_rest(self) -> bool:
        """Whether samples and set points are all that moves its objects."""
        return self._profile.idle and not self._courses.sources

    def packed(self, count: int) -> PackedTpdos | None:
        """Return what sends the frames of a node that may rest; None while its services are busy.

        Args:
            count: number of the last sample, as whoever samples counts them.

        """
        busy = (
            self._state is not State.OPERATIONAL
            or self._emergency.active
            or self._emergency.queue
            or self._produces
            or self._sdo.busy
            or self._guarding.requests
            or self._lss.answers
            or self.distortions
            or not self._sensors.inside
        )
        return None if busy else self.rest.packed(count)

    def begin_rest(self, packed: PackedTpdos, sampled: Sampled) -> None:
        """Let the services sleep until something happens, and `packed` publish meanwhile.

        Args:
            packed: what `packed()` has returned, with its place in the record.
            sampled: returns the last sample that was published.

        """
        if self._resting_routes is None:
            ordinary, asked = self._ordinary_routes
            data = routes_at_rest(ordinary, self._shared, self._pdos, self._sync, self.attend)
            self._resting_routes = data, waking(asked, self.attend)
        self._routes, self._remote_routes = self._resting_routes
        until_ns = min(self._consumer.due_ns, self._guarding.due_ns)
        self.rest.begin(packed, self._heartbeat, until_ns, sampled, self.attend)
        self.repeat = packed.publish

    def attend(self, *, renewed: bool = False) -> None:
        """Wake the services: something happens that is theirs to decide.

        Args:
            renewed: whether there is a newer sample than the last that was published.

        """
        if self.rest.on:
            self._routes, self._remote_routes = self._ordinary_routes
            self.rest.end(renewed=renewed)

    def _before_write(self) -> None:
        self.attend()
        self._resting_routes = None

    def _on_written(self, entries: Sequence[Entry]) -> None:
        self._set_points.written(entries)
        self._profile.written(entries)

    def _produce(self, now_ns: int, frames: list[Frame]) -> None:
        """Append SYNC and TIME where the node is their producer; it hears its own SYNC too."""
        sync = self._sync_producer.due(now_ns)
        if sync is not None:
            frames.append(sync)
            self._on_sync(now_ns, sync.data)
        time = self._time.due(now_ns)
        if time is not None:
            frames.append(time)
        self._produces = self._sync_producer.produces or self._time.produces

    def raise_error(self, key: Hashable, code: int, bit: ErrorBit) -> None:
        """Let the node report an error of its hardware, until it is cleared.

        The same error again is no news, so it may be told each tick; an NMT reset forgets it.

        Args:
            key: names the condition.
            code: emergency error code (CiA 301 7.2.7.1).
            bit: its bit in the error register, besides the generic one.

        """
        self.attend()
        self._emergency.raise_error(key, code, bit)

    def clear_error(self, key: Hashable) -> None:
        """Let the node report that an error of its hardware is gone."""
        if key in self._emergency.active:
            self._emergency.clear(key)

    def bindings(self) -> list[layout.Binding]:
        """Return the table of objects from 0x2000 on and what each is bound to."""
        return layout.bindings(self.dictionary, self._sources)

    def unfed(self) -> list[tuple[str, Entry]]:
        """Return the objects in TPDOs that nothing feeds; they hold their defaults."""
        return layout.unfed(self.pdos, self._sources)

    def pdo_map(self) -> list[layout.PdoRow]:
        """Return the PDOs as they are configured now, RPDOs first."""
        return [layout.pdo_row(p.parameters) for p in self._pdos.all]

    @property
    def pdos(self) -> list[PdoParameters]:
        """The parameters of all PDOs, RPDOs first."""
        return [item.parameters for item in self._pdos.all]

    def bus_load(self, sync_us: int, tick_us: int = 1000) -> float:
        """Return the worst-case load in bit/s of the node's periodic traffic.

        Args:
            sync_us: assumed period of SYNC, 0 without SYNC.
            tick_us: period the node is called with.

        """
        heartbeat = self.dictionary.get(PRODUCER_HEARTBEAT_TIME)
        return bus_load.worst_case(
            [tpdo.parameters for tpdo in self._pdos.tpdos],
            [rpdo.parameters for rpdo in self._pdos.rpdos],
            0 if heartbeat is None else heartbeat.value,
            sync_us,
            tick_us,
        )

    # -- NMT ------------------------------------------------------------------------------

    def _on_nmt(self, now_ns: int, data: bytes) -> None:
        command = nmt.parse(data, self.node_id)
        if command is None or self._state is State.INITIALISING:
            return
        state = nmt.NEXT_STATE[command]
        if state is State.INITIALISING:
            self._reset(ALL_OBJECTS if command is Command.RESET_NODE else COMMUNICATION_OBJECTS)
        elif state is not self._state:
            self._enter(state)

    def _enter(self, state: State) -> None:
        if self._state is State.OPERATIONAL:
            self._pdos.stop()
        self._state = state
        self._set_points.stale = True
        if state is State.STOPPED:
            self._sdo.reset()
            self._sync_producer.reset()
        if state is State.OPERATIONAL:
            self._pdos.start()
        self._route()

    def _self_starting(self) -> bool:
        """Return whether the node starts without a master (CiA 302-2, 0x1F80)."""
        startup = self.dictionary.get(NMT_STARTUP)
        if self._autostart is not None or startup is None:
            return bool(self._autostart)
        return not startup.value & (NMT_MASTER | NOT_SELF_STARTING)

    def _check_partners(self, now_ns: int) -> None:
        if self._consumer.expired(now_ns) or self._guarding.expired(now_ns):
            self._on_communication_error()

    def _on_communication_error(self) -> None:
        """Obey 0x1029:01 after a heartbeat or life guarding event (CiA 301 7.5.2.32)."""
        entry = self.dictionary.get(ERROR_BEHAVIOUR, COMMUNICATION_ERROR)
        behaviour = ErrorBehaviour.PRE_OPERATIONAL if entry is None else entry.value
        if behaviour == ErrorBehaviour.STOPPED and self._state is not State.STOPPED:
            self._enter(State.STOPPED)
        elif behaviour == ErrorBehaviour.PRE_OPERATIONAL and self._state is State.OPERATIONAL:
            self._enter(State.PRE_OPERATIONAL)

    def _reset(self, indices: range) -> None:
        """Reload defaults; boot-up follows with the next `publish`."""
        if self._lss.activate() != UNCONFIGURED:
            self.dictionary.renumber(self._lss.node_id)
        self._enter(State.INITIALISING)
        self._store.reset(indices)
        self._set_points.fall_back()
        self._emergency.reset()
        self._sensors.reset()
        self._profile.reset()
        if self._sensors.shown is not None:
            self._profile.measure(0, self._sensors.shown)  # nothing is monitored yet
        self._sdo.reset()
        self._sync_producer.reset()
        self._time.reset()
        self._programs.reset()
        self._pdos.reload()
        self._guarding.reset()
        self._consumer.reset()

    def _configured(self) -> None:
        """Boot with the node-ID that LSS has given to an unconfigured node."""
        self._reset(COMMUNICATION_OBJECTS)

    # -- routes: which service takes which frame in the state the node is in ---------------

    def _route(self) -> None:
        """Rebuild the routes (states and services: CiA 301 7.3.2.2)."""
        routes: dict[int, list[Handler]] = {}
        remote: dict[int, list[Handler]] = {}
        if self._state is not State.OPERATIONAL:
            routes[LSS_REQUEST] = [self._lss.request]
        if self._state is not State.INITIALISING:
            routes[nmt.NMT_COB_ID] = [self._on_nmt]
        if self._state in (State.PRE_OPERATIONAL, State.OPERATIONAL):
            self._sdo.add_routes(routes)
        rerouting = set(routes)
        if self._state is not State.INITIALISING:
            remote[ERROR_CONTROL_COB_ID + self.node_id] = [self._guarding.request]
            for node_id in self._consumer.node_ids:
                routes[ERROR_CONTROL_COB_ID + node_id] = [self._heartbeat_handler(node_id)]
        if self._state in (State.PRE_OPERATIONAL, State.OPERATIONAL):
            if self._sync.can_id is not None:
                routes.setdefault(self._sync.can_id, []).append(self._on_sync)
            if self._time.can_id is not None:
                routes.setdefault(self._time.can_id, []).append(self._time.receive)
        if self._state is State.OPERATIONAL:
            self._pdos.add_routes(routes, remote)
        self._shared = {can_id for can_id, handlers in routes.items() if len(handlers) > 1}
        self._ordinary_routes = _joined(routes), _joined(remote)
        self._routes, self._remote_routes = self._ordinary_routes
        self._resting_routes = None
        self.hears = {can_id: can_id in rerouting for can_id in routes}
        self.asked = frozenset(remote)
        self._produces = True  # or no longer: the next tick will tell
        self.on_route()

    def _heartbeat_handler(self, node_id: int) -> Handler:
        def handle(now_ns: int, data: bytes) -> None:
            if len(data) == 1:
                self._consumer.heard(now_ns, node_id)

        return handle

    def _on_sync(self, now_ns: int, data: bytes) -> None:
        counter = self._sync.accept(data)
        if counter is not None and self._state is State.OPERATIONAL:
            self._pdos.sync(now_ns, counter, self._sync)


def _joined(routes: Mapping[int, Sequence[Handler]]) -> Routes:
    """Return one handler for each identifier: in its place, or for all that it has."""
    return {i: h[0] if len(h) == 1 else _in_turn(h) for i, h in routes.items()}


def _in_turn(handlers: Sequence[Handler]) -> Handler:
    def handle(now_ns: int, data: bytes) -> None:
        for handler in handlers:
            handler(now_ns, data)

    return handle
