"""A part of a machine in one process: the whole machine, or an independent group of actuators."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import click

from hil_emulator.bus.bus import Bus
from hil_emulator.commands.check import refuse_collisions
from hil_emulator.commands.live import (
    FOREVER,
    StatusOutput,
    departures,
    keep_running,
    load,
    summary,
    traffic,
)
from hil_emulator.commands.recording import RecordOptions, machine_recorded
from hil_emulator.config.machine import MachineSettings
from hil_emulator.faults.fault import Fault
from hil_emulator.platform.paths import cache_folder, near
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.simulation import realtime
from hil_emulator.simulation.clock import Clock, LockStep, WallClock
from hil_emulator.simulation.loop import Timing
from hil_emulator.simulation.machine import Machine, assemble_machine
from hil_emulator.simulation.not_finite import PlantFailedError


@dataclass(frozen=True)
class MachineRun:
    """Options of a run of several actuators.

    Attributes:
        clock: "wall" or "lockstep".
        duration: emulator time to run [s]; None runs until interrupted.
        recording: options of the recording; the files of each actuator carry its name.
        faults: pairs of an actuator's name and a fault.

    """

    clock: str
    duration: float | None
    recording: RecordOptions
    faults: Sequence[tuple[str, Fault]]


def run_part(
    settings: MachineSettings, order: MachineRun, teller: StatusOutput, begin: Callable[[], None]
) -> None:
    """Run a part of a machine, whose models are compiled.

    Args:
        settings: the part.
        order: options of the run; faults of other actuators are ignored.
        teller: output of the status.
        begin: called when all is assembled; the first tick follows.

    Raises:
        UserError: for every error of the input.
        PlantFailedError: at the end, if an FMU failed meanwhile.
        HelperFailedError: at the end, if a recording is incomplete; at once, if it is required.

    """
    tick_ns = settings.actuators[0].config.tick_ns
    with Supervisor(teller.warn) as supervisor, ExitStack() as stack:
        buses = {name: stack.enter_context(Bus(t)) for name, t in settings.buses.items()}
        machine = assemble_machine(settings, buses, cache_folder())
        for name in buses:
            there = [a.name for a in settings.actuators if a.bus == name]
            refuse_collisions(name, [n for a in there for n in machine.rigs[a].nodes])
        stack.enter_context(machine_recorded(machine, settings, order.recording, supervisor))
        broken = [(name, fault) for name, fault in order.faults if name in machine.rigs]
        for name, fault in broken:
            machine.rigs[name].inject(fault)
        measures = [] if order.clock == "lockstep" else realtime.apply()
        click.echo(_banner(settings, buses, measures))
        for name, fault in broken:
            click.echo(f"fault     {name}: {fault.words}")
        pace: Clock = LockStep() if order.clock == "lockstep" else WallClock(tick_ns)
        ticks = FOREVER if order.duration is None else round(order.duration * 1e9 / tick_ns)
        timing, doors = Timing(), list(buses.values())
        begin()
        try:
            keep_running(
                machine, pace, ticks, timing, lambda: _status(machine, timing, doors),
                supervisor.look if order.recording.files else None,
                stop_when_late=any(a.config.late == "stop" for a in settings.actuators),
                teller=teller,
            )  # fmt: skip
        finally:
            wires, left = machine.wires.values(), departures(machine.rigs)
            click.echo(summary(machine, timing, doors, wires, left))
        failures = {name: rig.plant.supply.failure for name, rig in machine.rigs.items()}
        failed = [f"{name}: {why}" for name, why in failures.items() if why]
        if failed:
            raise PlantFailedError("; ".join(failed))


def _banner(
    settings: MachineSettings, buses: Mapping[str, Bus], measures: Sequence[realtime.Measure]
) -> str:
    lines = [
        f"node      {node.id} on {actuator.bus}  {actuator.name}  {near(node.eds)}"
        for actuator in settings.actuators
        for node in actuator.config.nodes
    ]
    for supply in dict.fromkeys(a.supply for a in settings.actuators if a.supply):
        on_it = ", ".join(a.name for a in settings.actuators if a.supply == supply)
        lines.append(f"supply    {supply}: {on_it}")
    lines += [f"leg       {a.name} carries {a.carries}" for a in settings.actuators if a.carries]
    for name, bus in buses.items():
        lines.append(f"bus       {name}: {bus.description}")
        lines.append(f"connect   {bus.client_command}")
    if measures:
        lines.append("realtime  " + "; ".join(str(m) for m in measures))
    return "\n".join(lines)


def _status(machine: Machine, timing: Timing, buses: Sequence[Bus]) -> str:
    positions = "  ".join(
        f"{name} {rig.plant.signals.position * 1e3:.1f} mm" for name, rig in machine.rigs.items()
    )
    rest = f"{load(machine.wires.values())}  late {timing.overruns}"
    return f"{machine.now_ns * 1e-9:9.1f} s  {positions}  {traffic(buses)}{rest}"
