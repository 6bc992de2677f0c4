"""The CANopen node: the services of CiA 301 around one dictionary.

The order of a tick is the contract with the rig: `receive` all frames, integrate the plant,
`publish` its sample. `publish` sends frames in this order, which nearly matches their priority with
the predefined connection set: SYNC, TIME, EMCY, TPDOs by number, SDO answers, error control.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

from hil_emulator.device import bus_load, layout
from hil_emulator.device.course import Course
from hil_emulator.device.dictionary import COMMUNICATION_OBJECTS, UNCONFIGURED, Dictionary
from hil_emulator.device.distortion import Distortion
from hil_emulator.device.emergency import ErrorBit
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import PRODUCER_HEARTBEAT_TIME
from hil_emulator.device.fast_path import FastPath, Sampled
from hil_emulator.device.measured import Measured
from hil_emulator.device.nmt import State
from hil_emulator.device.nmt_slave import NmtSlave
from hil_emulator.device.packed_tpdos import PackedTpdos
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.device.routing import Routing, routing_of
from hil_emulator.device.services import Services
from hil_emulator.device.storage import MemoryStorage, Storage
from hil_emulator.frame import EXTENDED, Frame


class Node:
    """A CiA 301 slave: frames, samples and the time in; frames and commands out.

    The first `publish` sends the boot-up message and enters PRE-OPERATIONAL.

    Args:
        dictionary: the node's dictionary; other users must not change it.
        channels: names of the sensor channels; an object of the same name shows the channel.
        commands: safe value in SI of each command the plant understands; the object of the
            same name is its set point.
        storage: where parameters saved by 0x1010 are kept; in memory by default.
        courses: objects that follow a course over time.
        autostart: whether it enters OPERATIONAL by itself; None leaves it to 0x1F80.

    Attributes:
        dictionary: as given.
        hears: identifiers of all data frames that the node accepts in its present state (bit 29
            set for 29-bit identifiers), and whether the frame may change this table.
        asked: identifiers of the remote frames that it accepts.
        on_route: called when these tables have changed.
        fast_path: whether and until when the node is on its fast path.
        repeat: replaces `publish` on the fast path: takes time and record, returns frames.
        distortions: active faults of its objects.

    Raises:
        UserError: a command has no RPDO-mappable object, or a default PDO maps an object that does
            not exist or is not mappable.

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
        self._services = services = Services(
            dictionary,
            channels,
            commands,
            storage or MemoryStorage(),
            courses,
            self._route,
            self._configured,
        )
        self._nmt = NmtSlave(dictionary, services, autostart, self._route)
        # used in each tick
        self._profile, self._sensors = services.profile, services.sensors
        self._set_points, self._pdos = services.set_points, services.pdos
        self._consumer, self._guarding = services.consumer, services.guarding
        self._courses = services.courses
        self.fast_path = FastPath(services)
        self.repeat: Callable[[int, bytearray], Sequence[Frame]]
        self._routing: Routing
        self._route()
        dictionary.before_write = self.leave_fast_path
        services.emergency.before_error = self._pdos.before_event = self.leave_fast_path

    @property
    def node_id(self) -> int:
        """The node-ID, 1 to 127; LSS may change it."""
        return self.dictionary.node_id

    @property
    def state(self) -> State:
        """The NMT state."""
        return self._nmt.state

    @property
    def commanded(self) -> bool:
        """Whether it is OPERATIONAL, and has received a set point if it has any."""
        return self.state is State.OPERATIONAL and self._set_points.commanded

    def receive(self, now_ns: int, frames: Iterable[Frame]) -> Mapping[str, float]:
        """Handle all frames since the last tick.

        Args:
            now_ns: time of this tick, not before the last tick's.
            frames: in the order of their arrival; any frame is allowed.

        Returns:
            The value in SI of every command, in force from now on.

        """
        for can_id, data, remote, extended in frames:
            routes = self._remote_routes if remote else self._routes
            handler = routes.get(can_id | EXTENDED if extended else can_id)
            if handler is not None:
                handler(now_ns, data)
        until_ns = self.fast_path.until_ns
        if until_ns:
            if now_ns < until_ns or self.fast_path.still(now_ns):
                if self._set_points.stale:
                    self._set_points.update(operational=True)
                return self._set_points.commands
            self.leave_fast_path()
        if now_ns >= self._consumer.due_ns or now_ns >= self._guarding.due_ns:
            self._check_partners(now_ns)
        operational = self._nmt.state is State.OPERATIONAL
        if operational:
            self._pdos.check_deadlines(now_ns)
        if self._set_points.stale:
            self._set_points.update(operational=operational)
        return self._profile.command(now_ns, self._set_points.commands, operational=operational)

    def publish(self, now_ns: int, measured: Measured) -> list[Frame]:
        """Show the tick's sample and return the frames due, in the order of sending.

        Args:
            now_ns: time of the preceding `receive`.
            measured: one value per channel, in the order of the channels' names. The same object
                as in the last tick is not a new sample.

        """
        self.leave_fast_path()
        if self._sensors.sample(now_ns, measured):
            self._profile.measure(now_ns, measured)
        if self._courses.sources:
            self._courses.publish(now_ns)
        for distortion in self.distortions:
            distortion.publish(now_ns)
        frames: list[Frame] = []
        services = self._services
        if services.lss.answers:
            services.lss.publish(frames)
        if self._nmt.state is State.INITIALISING:
            if services.lss.node_id != UNCONFIGURED:
                frames.append(services.heartbeat.boot_up(now_ns))
                self._nmt.begin()
            return frames
        if measured.overrange != self._sensors.overrange:
            self._sensors.check_ranges(measured.overrange)
        state = self._nmt.state
        if state is not State.STOPPED:
            if self._produces:
                self._produce(now_ns, frames)
            if services.emergency.queue:
                services.emergency.publish(now_ns, frames)
            if state is State.OPERATIONAL:
                self._pdos.publish(now_ns, frames)
            if services.sdo.busy:
                services.sdo.publish(now_ns, frames)
        if self._guarding.requests:
            self._guarding.publish(state, frames)
        if now_ns >= services.heartbeat.due_ns:
            services.heartbeat.publish(now_ns, state, frames)
        return frames

    # -- the fast path: see `fast_path` -----------------------------------------------------

    @property
    def quiet_until_ns(self) -> int:
        """Earliest time at which a service has something to do."""
        return self._services.quiet_until_ns

    def packed(self, count: int) -> PackedTpdos | None:
        """Return the sender of TPDOs on the fast path; None if TPDOs need their services.

        Args:
            count: number of the last sample, as the sensors count them.

        """
        return self._pdos.packed(self._sensors, count)

    def enter_fast_path(self, until_ns: int, packed: PackedTpdos, sampled: Sampled) -> None:
        """Skip the services until they have something to do; `packed` publishes meanwhile.

        Args:
            until_ns: value of `quiet_until_ns`.
            packed: result of `packed()`, with its place in the record.
            sampled: returns the last sample that was published.

        """
        self._routes, self._remote_routes = self._routing.fast_data, self._routing.fast_remote
        self.fast_path.enter(until_ns, packed, sampled, self.leave_fast_path)
        self.repeat = packed.publish

    def leave_fast_path(self, *, renewed: bool = False) -> None:
        """Resume the services with all objects up to date.

        Args:
            renewed: whether a newer sample than the last published one exists.

        """
        if self.fast_path.until_ns:
            self._routes, self._remote_routes = self._routing.data, self._routing.remote
            self.fast_path.leave(renewed=renewed)

    def _produce(self, now_ns: int, frames: list[Frame]) -> None:
        """Append SYNC and TIME if the node produces them; it also consumes its SYNC."""
        producer, clock = self._services.sync_producer, self._services.time
        sync = producer.due(now_ns)
        if sync is not None:
            frames.append(sync)
            self._routing.sync(now_ns, sync.data)
        time = clock.due(now_ns)
        if time is not None:
            frames.append(time)
        self._produces = producer.produces or clock.produces

    def bus_off(self) -> None:
        """Apply 0x1029 when the node's controller enters bus-off (CiA 301 7.5.2.32)."""
        self.leave_fast_path()
        self._nmt.on_communication_error()

    def raise_error(self, key: Hashable, code: int, bit: ErrorBit) -> None:
        """Report an error of the node's hardware until it is cleared.

        Repeating the call has no effect, so it may be made each tick. An NMT reset clears the
        error.

        Args:
            key: names the condition.
            code: emergency error code (CiA 301 7.2.7.1).
            bit: its bit in the error register, besides the generic one.

        """
        self._services.emergency.raise_error(key, code, bit)

    def clear_error(self, key: Hashable) -> None:
        """Report the end of an error of the node's hardware."""
        if key in self._services.emergency.active:
            self._services.emergency.clear(key)

    def bindings(self) -> list[layout.Binding]:
        """Return the table of objects from 0x2000 on with their bindings."""
        return layout.bindings(self.dictionary, self._services.sources)

    def unfed(self) -> list[tuple[str, Entry]]:
        """Return the objects in TPDOs without a source of values; they hold their defaults."""
        return layout.unfed(self.pdos, self._services.sources)

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

    # -- routes: which service handles which frame in the node's state ----------------------

    def _route(self) -> None:
        """Rebuild the routes."""
        state, request = self._nmt.state, self._nmt.request
        self._routing = routing = routing_of(
            self._services, self.node_id, state, request, self.leave_fast_path
        )
        self._routes, self._remote_routes = routing.data, routing.remote
        self.hears, self.asked = routing.hears, frozenset(routing.remote)
        self._produces = True  # checked again in the next tick
        self.on_route()

    def _check_partners(self, now_ns: int) -> None:
        if self._consumer.expired(now_ns) or self._guarding.expired(now_ns):
            self._nmt.on_communication_error()

    def _configured(self) -> None:
        """Boot with the node-ID that LSS has assigned to an unconfigured node."""
        self._nmt.reset(COMMUNICATION_OBJECTS)
