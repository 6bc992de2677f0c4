"""`hil-emulator run`: the emulator on a bus, until its time is over or Ctrl-C."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from hil_emulator import __version__
from hil_emulator.bus.bus import Bus
from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.commands.check import refuse_collisions
from hil_emulator.commands.live import (
    FOREVER,
    Terminal,
    departures,
    keep_running,
    load,
    summary,
    traffic,
)
from hil_emulator.commands.live_play import LivePlay
from hil_emulator.commands.recording import NOT_RECORDED, RecordOptions, recorded
from hil_emulator.commands.run_machine import run_machine
from hil_emulator.commands.run_scenario import ScenarioOptions, play_runs
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.bus import DEFAULT_BUS
from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.panel.server_process import Panel, PanelOptions, require_server
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording.several import Recorders
from hil_emulator.remote.control_server import ControlServer
from hil_emulator.remote.rig_requests import Handlers, rig_requests
from hil_emulator.simulation import realtime
from hil_emulator.simulation.assembly import assemble
from hil_emulator.simulation.clock import Clock, FollowSync, LockStep, WallClock
from hil_emulator.simulation.loop import Ticking, Timing
from hil_emulator.simulation.machine import prepare
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


def run(
    files: Sequence[Path],
    bus: str | None,
    clock: str,
    duration: float | None,
    recording: RecordOptions = NOT_RECORDED,
    faults: Sequence[str] = (),
    operation: Operation = Operation(),
    scenario: ScenarioOptions | None = None,
) -> int:
    """Run the emulator and return the exit code.

    Args:
        files: configuration files, later over earlier.
        bus: "interface:channel", which replaces the configured one.
        clock: "wall", "lockstep" or "follow-sync".
        duration: emulator time to run [s]; None runs until interrupted.
        recording: options of the recording; of several actuators each has its own files.
        faults: faults, one per line; see `faults.fault.spoken` and `run_machine.placed`.
        operation: access and processes.
        scenario: played on the bus; its end ends the run.

    Raises:
        UserError: for every error of the input.
        HelperFailedError: at the end, if a helper process has failed; at once, if it is that of a
            required recording.

    """
    _check_duration(clock, duration, scenario)
    runs = scenario.runs() if scenario else []
    settings = load_machine(scenario.configuration(files) if scenario else files)
    if len(settings.actuators) > 1:
        _check_machine(bus, operation, scenario)
        run_machine(settings, clock, duration, recording, faults, operation.processes)
        return 0
    if len(runs) > 1 and (operation.panel or operation.control):
        raise UserError("--panel and --control show one run; this scenario has several")
    recording.check()
    injected = [spoken(line) for line in faults]
    config = settings.actuators[0].config
    settings_of_bus = bus_settings(config, bus, operation.port)
    with waiting(PREPARING):
        prepare(settings, cache_folder())  # before a client can connect
    with Supervisor(Terminal().warn) as supervisor, Bus(settings_of_bus) as bus_port:

        def run_once(
            play: LivePlay | None, config: Configuration, recording: RecordOptions
        ) -> None:
            recorder = partial(recorded, config=config, options=recording, supervisor=supervisor)
            extent = Extent(clock, duration, injected, play)
            _on_bus(bus_port, config, extent, recorder, operation, supervisor)

        if scenario:
            return play_runs(scenario, runs, config, recording, run_once)
        run_once(None, config, recording)
        return 0


def _check_duration(clock: str, duration: float | None, scenario: ScenarioOptions | None) -> None:
    """Refuse a duration that contradicts the scenario or that the clock lacks."""
    if scenario and duration is not None:
        raise UserError("--duration: the scenario has its own duration; leave the option out")
    if clock == "lockstep" and duration is None and not scenario:
        raise UserError("the lock-step clock does not wait: add --duration")


def _check_machine(bus: str | None, operation: Operation, scenario: ScenarioOptions | None) -> None:
    """Refuse options that a machine of several actuators does not have."""
    if bus or scenario or operation != Operation(processes=operation.processes):
        raise UserError(
            "--bus, --port, --control, --panel and --scenario are for one actuator; run its own "
            "files"
        )


def _on_bus(
    bus_port: Bus, config: Configuration, extent: "Extent",
    recorder: Callable[[Rig], AbstractContextManager[object]],
    operation: Operation, supervisor: Supervisor,
) -> None:  # fmt: skip
    """Run the rig on its bus, with panel and remote control."""
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
        click.echo(_banner(config, rig, bus_port, clock, measures))
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
            lambda: _status(rig, timing, bus),
            between=between,
            stop_when_late=config.late == "stop",
        )
    finally:
        click.echo(summary(rig, timing, [bus], _wires(rig), departures({"the rod": rig})))
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


def operation(
    port: int | None, control: int | None, panel: str | None, processes: int | None
) -> Operation:
    """Return the options of the command line.

    Args:
        port: of the bus.
        control: port of the remote control.
        panel: "full", "view only", or "".
        processes: see `Operation`.

    Raises:
        UserError: if the panel's packages are not installed.

    """
    if panel:
        require_server()
    opened = PanelOptions(panel == "view only") if panel else None
    return Operation(port, control, opened, processes)


def bus_settings(
    config: Configuration, override: str | None, port: int | None = None
) -> Mapping[str, Any]:
    """Return the `[bus]` table, changed by `--bus interface:channel` and `--port`.

    Raises:
        UserError: for an unreadable `--bus`, or a `--port` for a bus without one.

    """
    chosen = config.bus if override is None else _other_bus(config, override)
    if port is None:
        return chosen
    if chosen.get("interface") != DEFAULT_BUS["interface"]:
        raise UserError(f"--port: a bus of {chosen.get('interface')} listens on no TCP port")
    return {**chosen, "port": port}


def _other_bus(config: Configuration, override: str) -> Mapping[str, Any]:
    interface, colon, channel = override.partition(":")
    if not colon or not interface or not channel:
        raise UserError(f'--bus {override}: write interface:channel, such as "socketcan:vcan0"')
    kept = config.bus if config.bus.get("interface") == interface else {}
    return {**kept, "interface": interface, "channel": channel}


def _clock(name: str, config: Configuration, follow: FollowSync | None, rig: Rig) -> Clock:
    if follow is not None:
        follow.serve = rig.serve
        rig.serve(())  # the boot-up messages: a node does not answer before them
        return follow
    return LockStep() if name == "lockstep" else WallClock(config.tick_ns)


def _banner(
    config: Configuration, rig: Rig, bus: Bus, clock: str, measures: Sequence[realtime.Measure]
) -> str:
    names = {"wall": "wall clock", "lockstep": "lock-step", "follow-sync": "follows SYNC"}
    files = ", ".join(near(f) for f in config.files)
    lines = [f"hil-emulator {__version__}  {files}  (digest {config.digest})"]
    lines += [f"node      {n.id}  {near(n.eds)}" for n in config.nodes]
    lines += [f"partner   {p.table.name}  {near(p.dbc)}" for p in config.partners]
    if config.fmu:
        lines.append(f"plant     {near(config.fmu.file)}")
    lines.append(f"bus       {bus.description}")
    lines.append(
        f"tick      {config.tick_ns / 1e6:g} ms, {config.steps} steps of {config.step * 1e6:g} us, "
        f"{names[clock]}"
    )
    if measures:
        lines.append("realtime  " + "; ".join(str(m) for m in measures))
    lines += [f"connect   {bus.client_command}", "Ctrl-C ends."]
    return "\n".join(lines)


def _status(rig: Rig, timing: Timing, bus: Bus) -> str:
    y = rig.plant.signals
    states = ", ".join(f"{n.node_id} {n.state.name.lower()}" for n in rig.nodes)
    return (
        f"{rig.now_ns * 1e-9:9.1f} s  node {states}  x {y.position * 1e3:6.2f} mm  "
        f"f {y.load_force:7.0f} N  "
        f"pa {y.pressure_a * 1e-5:5.1f} pb {y.pressure_b * 1e-5:5.1f} bar  "
        f"{traffic([bus])}{load(_wires(rig))}  late {timing.overruns}"
    )


def _wires(rig: Rig) -> list[TimedWire]:
    return [rig.wire] if rig.wire else []
