"""The NMT state of a node and its transitions (CiA 301 7.3.2)."""

from collections.abc import Callable

from hil_emulator.device import nmt
from hil_emulator.device.dictionary import ALL_OBJECTS, COMMUNICATION_OBJECTS, Dictionary
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
from hil_emulator.device.services import Services


class NmtSlave:
    """Holds the NMT state of a node and makes its transitions.

    Args:
        dictionary: holds the error behaviour (0x1029) and the start-up behaviour (0x1F80).
        services: are started, stopped and reset with the node.
        autostart: as of `Node`.
        on_route: called when the state has changed.

    Attributes:
        state: the NMT state.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        services: Services,
        autostart: bool | None,
        on_route: Callable[[], None],
    ) -> None:
        self.state = State.INITIALISING
        self._dictionary = dictionary
        self._services = services
        self._autostart = autostart
        self._on_route = on_route

    def request(self, now_ns: int, data: bytes) -> None:
        """Execute a command of the master."""
        command = nmt.parse(data, self._dictionary.node_id)
        if command is None or self.state is State.INITIALISING:
            return
        state = nmt.NEXT_STATE[command]
        if state is State.INITIALISING:
            self.reset(ALL_OBJECTS if command is Command.RESET_NODE else COMMUNICATION_OBJECTS)
        elif state is not self.state:
            self.enter(state)

    def enter(self, state: State) -> None:
        """Enter another state."""
        services = self._services
        if self.state is State.OPERATIONAL:
            services.pdos.stop()
        self.state = state
        services.set_points.stale = True
        if state is State.STOPPED:
            services.sdo.reset()
            services.sync_producer.reset()
        if state is State.OPERATIONAL:
            services.pdos.start()
        self._on_route()

    def begin(self) -> None:
        """Leave initialisation: boot-up is sent."""
        self.enter(State.PRE_OPERATIONAL)
        if self.self_starting():
            self.enter(State.OPERATIONAL)

    def self_starting(self) -> bool:
        """Return whether the node starts without a master (CiA 302-2, 0x1F80)."""
        startup = self._dictionary.get(NMT_STARTUP)
        if self._autostart is not None or startup is None:
            return bool(self._autostart)
        return not startup.value & (NMT_MASTER | NOT_SELF_STARTING)

    def on_communication_error(self) -> None:
        """Apply 0x1029:01 after bus-off, a heartbeat or life guarding event (CiA 301 7.5.2.32)."""
        entry = self._dictionary.get(ERROR_BEHAVIOUR, COMMUNICATION_ERROR)
        behaviour = ErrorBehaviour.PRE_OPERATIONAL if entry is None else entry.value
        if behaviour == ErrorBehaviour.STOPPED and self.state is not State.STOPPED:
            self.enter(State.STOPPED)
        elif behaviour == ErrorBehaviour.PRE_OPERATIONAL and self.state is State.OPERATIONAL:
            self.enter(State.PRE_OPERATIONAL)

    def reset(self, indices: range) -> None:
        """Reload defaults; boot-up follows with the next `Node.publish`."""
        self._services.activate_node_id()
        self.enter(State.INITIALISING)
        self._services.reset(indices)
