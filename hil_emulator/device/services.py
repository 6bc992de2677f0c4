"""The services of one node around its dictionary: construction and reset."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from hil_emulator.device.course import Course, Courses
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import ALL_OBJECTS, UNCONFIGURED, Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.lss import LssSlave
from hil_emulator.device.node_guarding import NodeGuarding
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.profiles.choice import profile_of
from hil_emulator.device.profiles.profile import NoProfile
from hil_emulator.device.program_download import ProgramDownload
from hil_emulator.device.sdo_channels import SdoChannels
from hil_emulator.device.sensor_objects import SensorObjects
from hil_emulator.device.set_points import SetPoints
from hil_emulator.device.storage import ParameterStore, Storage
from hil_emulator.device.sync import SyncConsumer, SyncProducer
from hil_emulator.device.time_stamp import TimeStamp
from hil_emulator.device.trigger import Trigger
from hil_emulator.device.verify_configuration import VerifyConfiguration


class Services:
    """The services of one node; `routing` decides which of them act in which state.

    Args:
        dictionary: as of `Node`, as are channels, commands and courses.
        channels: names of the sensor channels.
        commands: safe value of each command.
        storage: where parameters are kept.
        courses: objects that follow a course over time.
        on_route: called when the identifiers that a service accepts have changed.
        on_node_id: called when LSS has given a node-ID to an unconfigured node.

    Raises:
        UserError: as `Node`.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        channels: Sequence[str],
        commands: Mapping[str, float],
        storage: Storage,
        courses: Sequence[tuple[Entry, Course]],
        on_route: Callable[[], None],
        on_node_id: Callable[[], None],
    ) -> None:
        self._dictionary = dictionary
        self.lss = LssSlave(dictionary, storage, on_node_id)
        if self.lss.node_id != UNCONFIGURED:
            dictionary.renumber(self.lss.node_id)
        self.emergency = Emergency(dictionary)
        self.profile = profile_of(dictionary, channels, self.emergency)
        claimed = self.profile.sources
        self.sensors = SensorObjects(dictionary, channels, self.emergency, claimed)
        self.set_points = SetPoints(dictionary, commands)
        self.courses = Courses(courses)
        self.store = ParameterStore(dictionary, storage)
        self.store.reset(ALL_OBJECTS)
        self.set_points.fall_back()
        self.profile.reset()
        self.sdo = SdoChannels(dictionary, on_route)
        self.heartbeat = Heartbeat(dictionary)
        self.guarding = NodeGuarding(dictionary, self.emergency)
        self.consumer = HeartbeatConsumer(dictionary, self.emergency, on_route)
        self.sync = SyncConsumer(dictionary, self.emergency, on_route)
        self.sync_producer = SyncProducer(dictionary)
        self.time = TimeStamp(dictionary, on_route)
        self.verification = VerifyConfiguration(dictionary)
        self.programs = ProgramDownload(dictionary)
        triggers = [Trigger(entry, delta=entry.delta) for entry in dictionary if entry.delta]
        self.pdos = ProcessData(
            dictionary,
            self.emergency,
            self.set_points,
            self.sync,
            [*self.profile.triggers, *triggers],
            None if isinstance(self.profile, NoProfile) else self.profile.written,
            on_route,
        )

    @cached_property
    def by_name(self) -> dict[str, object]:
        """Every service: all attributes but the dictionary."""
        return {name: s for name, s in vars(self).items() if s is not self._dictionary}

    @cached_property
    def _acting_unasked(self) -> list[object]:
        """The services whose class does not declare `NEVER`."""
        services = self.by_name.values()
        return [s for s in services if getattr(type(s), "quiet_until_ns", NOW) is not NEVER]

    @property
    def sources(self) -> dict[tuple[int, int], str]:
        """Source of every bound object, by (index, sub-index)."""
        parts = self.sensors, self.set_points, self.profile, self.courses
        return {place: source for part in parts for place, source in part.sources.items()}

    def activate_node_id(self) -> None:
        """Activate a node-ID that LSS has assigned, if there is one."""
        if self.lss.activate() != UNCONFIGURED:
            self._dictionary.renumber(self.lss.node_id)

    def reset(self, indices: range) -> None:
        """Reload the defaults of some objects, and reset the services."""
        self.store.reset(indices)
        self.set_points.fall_back()
        self.emergency.reset()
        self.sensors.reset()
        self.profile.reset()
        if self.sensors.shown is not None:
            self.profile.measure(0, self.sensors.shown)  # monitoring has not started
        self.sdo.reset()
        self.sync_producer.reset()
        self.time.reset()
        self.programs.reset()
        self.pdos.reload()
        self.guarding.reset()
        self.consumer.reset()

    @property
    def quiet_until_ns(self) -> int:
        """The earliest time that a service declares: see `fast_path`."""
        earliest_ns = NEVER
        for service in self._acting_unasked:
            until_ns: int = getattr(service, "quiet_until_ns", NOW)
            if until_ns == NOW:
                return NOW
            if until_ns < earliest_ns:
                earliest_ns = until_ns
        return earliest_ns
