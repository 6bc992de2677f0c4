"""A bus with modelled timing for rigs: a port on the bus, and a router of frames.

Frames of nodes are queued in their controllers. Frames from outside are queued in a controller
without a limit, as if they had been sent at the tick of their arrival. A frame whose transmission
has ended at the beginning of a tick is received in that tick, and sent to the outside bus.
"""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol

from hil_emulator.can_timing.controller import CanController, ErrorState
from hil_emulator.can_timing.wire import Passed, TimedWire, WireError
from hil_emulator.config.bus import WireSettings
from hil_emulator.device.emergency import ErrorBit, ErrorCode
from hil_emulator.frame import BUS_OFF, RESTARTED, Frame
from hil_emulator.simulation.frame_router import FrameRouter, Participant


class CanPort(Protocol):
    """Interface of the bus for the rig."""

    def receive(self) -> list[Frame]:
        """Return the arrived frames without waiting."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames without waiting."""
        ...

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus, if it can carry one."""
        ...


class TimedCanPort:
    """A port of rigs on a bus with modelled timing, and on the outside bus.

    Args:
        bus: the outside bus.
        settings: its bit rate, and the depth of the nodes' transmit queues.

    Attributes:
        wire: model of the bus timing.
        arrived: frames from outside at this tick.
        passed: frames transmitted since the last tick, in this order.
        errors: errors of controllers since the last tick.
        standing: whether time is stopped, so that frames pass at once.

    """

    def __init__(self, bus: CanPort, settings: WireSettings) -> None:
        assert settings.bit_rate is not None
        self.wire = TimedWire(settings.bit_rate)
        self.arrived: list[Frame] = []
        self.passed: Sequence[Passed] = ()
        self.errors: Sequence[WireError] = ()
        self.standing = False
        self.now_ns = -1
        self._bus = bus
        self._depth = settings.transmit_queue
        self._outside = self.wire.attach()
        self.report = bus.report

    def attach(self) -> CanController:
        """Return the controller of a further node."""
        return self.wire.attach(self._depth)

    def begin(self, now_ns: int) -> None:
        """Begin a tick, once for all rigs: deliver transmitted frames and read new ones."""
        if now_ns <= self.now_ns:
            return
        self.now_ns = now_ns
        self.passed, self.errors = self.wire.advance(now_ns)
        self._bus.send([p.frame for p in self.passed if p.sender is not self._outside])
        for error in self.errors:
            self._bus.report(error.error_class)
        self.arrived = self._bus.receive()
        self.wire.queue(now_ns, self._outside, self.arrived)

    def receive(self) -> list[Frame]:
        """Return the frames from outside at this tick."""
        return self.arrived

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames at once while time is stopped; otherwise the wire sends them in order."""
        if self.standing:
            self._bus.send(frames)


class TimedRouter(FrameRouter):
    """Carries frames between nodes through a wire.

    Args:
        nodes: the rig's nodes.
        port: of their wire.

    """

    def __init__(self, nodes: Sequence[Participant], port: TimedCanPort) -> None:
        super().__init__(nodes)
        self._port = port
        self._controllers = {node: port.attach() for node in nodes}
        self._lost = dict.fromkeys(nodes, 0)

    def begin(self, now_ns: int) -> None:
        """Begin a tick: nodes report the errors of their controllers."""
        self._port.begin(now_ns)
        for node, controller in self._controllers.items():
            self._report_loss(node, controller)
            for error in self._port.errors:
                if error.controller is controller:
                    _report(node, error.error_class)
            if controller.error_state is ErrorState.PASSIVE:
                node.raise_error(ErrorState, ErrorCode.ERROR_PASSIVE, ErrorBit.COMMUNICATION)
            else:
                node.clear_error(ErrorState)

    def stand(self) -> None:
        """Pass frames at once from now on, because time is stopped."""
        self._port.standing = True

    def go_on(self) -> None:
        """Resume the time."""
        self._port.standing = False

    def disturb(
        self,
        destroys: Callable[[Participant, int], bool],
        acknowledged: Callable[[Participant, int], bool],
    ) -> None:
        """Set functions of node and time that disturb frames of nodes.

        Args:
            destroys: whether an error frame destroys the frame.
            acknowledged: whether another node acknowledges the frame.

        """
        for node, controller in self._controllers.items():
            controller.disturbed = functools.partial(destroys, node)
            controller.acknowledged = functools.partial(acknowledged, node)

    def publish(self, node: Participant, frames: Sequence[Frame]) -> None:
        """Queue a node's frames in its controller."""
        if self._port.standing:
            super().publish(node, frames)
        elif frames:
            self._port.wire.queue(self._port.now_ns, self._controllers[node], frames)

    def arriving(
        self, frames: Sequence[Frame], *, everything: bool
    ) -> Iterator[tuple[Participant, Sequence[Frame]]]:
        """Yield each node with the frames for it; a node in bus-off receives no frames."""
        if self._port.standing:
            yield from super().arriving(frames, everything=everything)
            return
        spoken, self._spoken = self._spoken, []  # sent while time was stopped
        for node, controller in self._controllers.items():
            heard = [frame for speaker, frame in spoken if speaker is not node]
            heard += [p.frame for p in self._port.passed if p.sender is not controller]
            yield node, [] if controller.off_until_ns is not None else heard

    def leaving(self, now_ns: int, sent: Sequence[Frame]) -> list[tuple[int, Sequence[Frame]]]:
        """Return the transmitted frames of these nodes, with their times."""
        if self._port.standing:
            return super().leaving(now_ns, sent)
        controllers = self._controllers.values()
        return [(p.done_ns, [p.frame]) for p in self._port.passed if p.sender in controllers]

    def _report_loss(self, node: Participant, controller: CanController) -> None:
        """Make a node report frames lost in its queue, until the queue is empty again."""
        if controller.lost > self._lost[node]:
            self._lost[node] = controller.lost
            node.raise_error(CanController, ErrorCode.CAN_OVERRUN, ErrorBit.COMMUNICATION)
        elif controller.head is None:
            node.clear_error(CanController)


def _report(node: Participant, error_class: int) -> None:
    """Make a node report an error of its controller, and apply its error behaviour."""
    if error_class == BUS_OFF:
        node.bus_off()
    elif error_class == RESTARTED:
        node.raise_error(BUS_OFF, ErrorCode.RECOVERED_FROM_BUS_OFF, ErrorBit.COMMUNICATION)
        node.clear_error(BUS_OFF)
