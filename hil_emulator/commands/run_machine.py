"""`hil-emulator run` of several actuators on their buses."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import click

from hil_emulator import __version__
from hil_emulator.bus.bus import Bus
from hil_emulator.commands.check import refuse_collisions
from hil_emulator.commands.live import FOREVER, departures, keep_running, load, summary, traffic
from hil_emulator.commands.recording import machine_recorded
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.machine import MachineSettings
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.recording.pre_trigger import Capture
from hil_emulator.simulation import realtime
from hil_emulator.simulation.clock import Clock, LockStep, WallClock
from hil_emulator.simulation.loop import Timing
from hil_emulator.simulation.machine import Machine, assemble_machine, prepare
from hil_emulator.simulation.not_finite import PlantFailedError


def run_machine(
    settings: MachineSettings,
    clock: str,
    duration: float | None,
    record: Sequence[Path] = (),
    capture: Capture | None = None,
    faults: Sequence[str] = (),
) -> None:
    """Run several actuators under one loop.

    Args:
        settings: the machine.
        clock: "wall" or "lockstep".
        duration: emulator time to run [s]; None runs until interrupted.
        record: files for signals and frames; each actuator's bears its name besides.
        capture: records only what is around a condition, where there is one.
        faults: what breaks, a line each; see `placed`.

    Raises:
        UserError: for whatever the user can mend.
        PlantFailedError: at the end, if an FMU failed meanwhile.

    """
    if clock == "follow-sync":
        raise UserError("several actuators have no common SYNC: use --clock wall or lockstep")
    broken = [placed(line, [a.name for a in settings.actuators]) for line in faults]
    tick_ns = settings.actuators[0].config.tick_ns
    with ExitStack() as stack:
        with waiting(PREPARING):
            prepare(settings, cache_folder())  # before anybody can connect
        buses = {name: stack.enter_context(Bus(t)) for name, t in settings.buses.items()}
        machine = assemble_machine(settings, buses, cache_folder())
        for name in buses:
            there = [a.name for a in settings.actuators if a.bus == name]
            refuse_collisions(name, [n for a in there for n in machine.rigs[a].nodes])
        stack.enter_context(machine_recorded(machine, settings, record, capture))
        for name, fault in broken:
            machine.rigs[name].inject(fault)
        measures = [] if clock == "lockstep" else realtime.apply()
        click.echo(_banner(settings, buses, measures))
        for name, fault in broken:
            click.echo(f"fault     {name}: {fault.words}")
        pace: Clock = LockStep() if clock == "lockstep" else WallClock(tick_ns)
        ticks = FOREVER if duration is None else round(duration * 1e9 / tick_ns)
        timing, doors = Timing(), list(buses.values())
        try:
            keep_running(
                machine, pace, ticks, timing, lambda: _status(machine, timing, doors),
                stop_when_late=any(a.config.late == "stop" for a in settings.actuators),
            )  # fmt: skip
        finally:
            wires, left = machine.wires.values(), departures(machine.rigs)
            click.echo(summary(machine, timing, doors, wires, left))
        failures = {name: rig.plant.supply.failure for name, rig in machine.rigs.items()}
        failed = [f"{name}: {why}" for name, why in failures.items() if why]
        if failed:
            raise PlantFailedError("; ".join(failed))


def placed(line: str, names: Sequence[str]) -> tuple[str, Fault]:
    """Return whom a fault befalls, and the fault: `hip.pressure_a offset value="3 bar"`.

    Raises:
        UserError: for a line that names no actuator, or a fault that cannot be.

    """
    for name in names:
        if line.startswith(f"{name}."):
            return name, spoken(line.removeprefix(f"{name}."))
    raise UserError(
        f"fault '{line}': begin with the name of an actuator, such as {names[0]}.{line}; "
        f"there are: {', '.join(names)}"
    )


def _banner(
    settings: MachineSettings, buses: dict[str, Bus], measures: list[realtime.Measure]
) -> str:
    lines = [f"hil-emulator {__version__}  {len(settings.actuators)} actuators"]
    for actuator in settings.actuators:
        for node in actuator.config.nodes:
            lines.append(
                f"node      {node.id} on {actuator.bus}  {actuator.name}  {near(node.eds)}"
            )
    for supply in dict.fromkeys(a.supply for a in settings.actuators if a.supply):
        on_it = ", ".join(a.name for a in settings.actuators if a.supply == supply)
        lines.append(f"supply    {supply}: {on_it}")
    lines += [f"leg       {a.name} carries {a.carries}" for a in settings.actuators if a.carries]
    for name, bus in buses.items():
        lines.append(f"bus       {name}: {bus.description}")
        lines.append(f"connect   {bus.client_command}")
    if measures:
        lines.append("realtime  " + "; ".join(str(m) for m in measures))
    return "\n".join([*lines, "Ctrl-C ends."])


def _status(machine: Machine, timing: Timing, buses: list[Bus]) -> str:
    positions = "  ".join(
        f"{name} {rig.plant.signals.position * 1e3:.1f} mm" for name, rig in machine.rigs.items()
    )
    told = f"{load(machine.wires.values())}  late {timing.overruns}"
    return f"{machine.now_ns * 1e-9:9.1f} s  {positions}  {traffic(buses)}{told}"
