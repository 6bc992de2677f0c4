"""One rig on its bus: clock, panel, remote control, scenario and faults of a run."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass

import click

from hil_emulator.bus.bus import Bus
from hil_emulator.commands.check import refuse_collisions
from hil_emulator.commands.live import FOREVER, departures, keep_running, summary
from hil_emulator.commands.live_play import LivePlay
from hil_emulator.commands.run_texts import banner, status, wires
from hil_emulator.config.load import Configuration
from hil_emulator.faults.fault import Fault
from hil_emulator.panel.server_process import Panel, PanelOptions
from hil_emulator.platform.paths import cache_folder
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.several import Recorders
from hil_emulator.remote.control_server import ControlServer
from hil_emulator.remote.rig_requests import Handlers, rig_requests
from hil_emulator.simulation import realtime
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import Clock, FollowSync, LockStep, WallClock
from hil_emulator.simulation.loop import Ticking, Timing
from hil_emulator.simulation.not_finite import PlantFailedError
from hil_emulator.simulation.rig import Rig
from hil_emulator.simulation.timed_can_port import CanPort


@dataclass(frozen=True)
class Operation:
    """Access to a run, and its processes.

    Attributes:
        port: TCP port of the bus, which replaces the configured one; 0 takes any free one.
        control: TCP port of the remote control; None without.
        panel: how the panel is opened; None without.
        processes: largest number of processes for several actuators, see `run_machine`.

    """

    port: int | None = None
    control: int | None = None
    panel: PanelOptions | None = None
    processes: int | None = None


PLAIN = Operation()
"""A run without panel and remote control, on the configured port."""


@dataclass(frozen=True)
class Extent:
    """What passes in a run, and when it ends.

    Attributes:
        clock: "wall", "lockstep" or "follow-sync".
        duration: emulator time to run [s]; None runs until interrupted.
        faults: injected at the start.
        play: scenario that is played, and whose end ends the run; None without.

    """

    clock: str
    duration: float | None
    faults: Sequence[Fault]
    play: LivePlay | None

    def ticks(self, tick_ns: int) -> int:
        """Return the number of ticks of a period [ns]."""
        return FOREVER if self.duration is None else round(self.duration * 1e9 / tick_ns)


def on_bus(
    bus_port: Bus, config: Configuration, extent: Extent,
    recorder: Callable[[Rig], AbstractContextManager[object]],
    operation: Operation, supervisor: Supervisor,
) -> None:  # fmt: skip
    """Run a rig on its bus, with panel and remote control.

    Args:
        bus_port: the open bus.
        config: of the rig.
        extent: what passes, and when it ends.
        recorder: records the rig while its context is open.
        operation: panel and remote control.
        supervisor: watches the helper processes.

    Raises:
        UserError: if the rig cannot do this; for a tick that is too late, if it shall end the run.
        PlantFailedError: at the end, if an FMU failed meanwhile.

    """
    clock, faults, play = extent.clock, extent.faults, extent.play
    follow = FollowSync(bus_port, config.sync_period_ns) if clock == "follow-sync" else None
    panel = Panel(operation.panel, follow or bus_port) if operation.panel else None
    port: CanPort = panel.hand if panel else follow or bus_port
    rig = assemble(config, play.port(port) if play else port, cache_folder())
    refuse_collisions("bus", rig.nodes)
    with ExitStack() as stack:
        stack.enter_context(recorder(rig))
        if panel:
            stack.enter_context(_open(panel, rig, config, bus_port, supervisor))
        timing = panel.timing if panel else Timing()
        handlers = rig_requests(bus_port, timing, supervisor)
        server = _control_server(operation.control, handlers, supervisor)
        control_server = stack.enter_context(server)
        for fault in faults:
            rig.inject(fault)
        measures = [] if clock == "lockstep" else realtime.apply()
        click.echo(banner(config, rig, bus_port, clock, measures))
        for fault in faults:
            click.echo(f"fault     {fault.words}")
        served = [server.serve for server in (control_server, panel) if server]
        pace = _clock(clock, config, follow, rig)
        if play:
            play.start(rig)

        def between() -> None:
            for serve in served:
                serve(rig)
            if play:
                play.serve()
            supervisor.look()

        if follow is not None:
            follow.idle = between
        course = (extent.ticks(config.tick_ns), timing, between)
        _live(rig, play or rig, pace, course, bus_port, config)


def _live(
    rig: Rig,
    ticking: Ticking,
    clock: Clock,
    course: tuple[int, Timing, Callable[[], None]],
    bus: Bus,
    config: Configuration,
) -> None:
    """Run with a status line, and print the summary even after an error.

    Args:
        rig: to run.
        ticking: what ticks: the rig, or a scenario with it.
        clock: decides when its ticks begin.
        course: number of ticks, their timing, and the service of helper processes between ticks.
        bus: of the rig.
        config: of the rig.

    """
    ticks, timing, between = course
    try:
        keep_running(
            ticking,
            clock,
            ticks,
            timing,
            lambda: status(rig, timing, bus),
            between=between,
            stop_when_late=config.late == "stop",
        )
    finally:
        click.echo(summary(rig, timing, [bus], wires(rig), departures({"the rod": rig})))
    if rig.plant.supply.failure:
        raise PlantFailedError(rig.plant.supply.failure)


@contextmanager
def _open(
    panel: Panel, rig: Rig, config: Configuration, bus: Bus, supervisor: Supervisor
) -> Iterator[None]:
    """Show the run in a browser while the context is open."""
    rig.recorder = Recorders(rig.recorder, panel.publisher) if rig.recorder else panel.publisher
    try:
        click.echo(f"panel     {panel.open(rig, config, bus, supervisor)}")
        yield
    finally:
        panel.close()


@contextmanager
def _control_server(
    port: int | None, handlers: Handlers, supervisor: Supervisor
) -> Iterator[ControlServer | None]:
    """Serve the remote control while the context is open, if it has a port."""
    if port is None:
        yield None
        return
    control_server = ControlServer(port, handlers=handlers)
    supervisor.watch(control_server.process)
    try:
        click.echo(f"control   http://127.0.0.1:{control_server.port}")
        yield control_server
    finally:
        control_server.close()


def _clock(name: str, config: Configuration, follow: FollowSync | None, rig: Rig) -> Clock:
    if follow is not None:
        follow.serve = rig.serve
        rig.serve(())  # the boot-up messages: a node does not answer before them
        return follow
    return LockStep() if name == "lockstep" else WallClock(config.tick_ns)
