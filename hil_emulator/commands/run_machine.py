"""`hil-emulator run` of several actuators on their buses."""

from collections.abc import Sequence

import click

from hil_emulator import __version__
from hil_emulator.commands.live import Terminal
from hil_emulator.commands.recording import NOT_RECORDED, RecordOptions, check_machine
from hil_emulator.commands.run_part import MachineRun, run_part
from hil_emulator.commands.run_parts import run_parts
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.machine import MachineSettings
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.platform.paths import cache_folder
from hil_emulator.platform.worker import can_fork, usable_cores
from hil_emulator.simulation.independent import parts
from hil_emulator.simulation.machine import prepare


def run_machine(
    settings: MachineSettings,
    clock: str,
    duration: float | None,
    recording: RecordOptions = NOT_RECORDED,
    faults: Sequence[str] = (),
    processes: int | None = None,
) -> None:
    """Run several actuators; those that share neither bus nor supply can have separate processes.

    Args:
        settings: the machine.
        clock: see `MachineRun`.
        duration: see `MachineRun`.
        recording: see `MachineRun`.
        faults: faults, one per line; see `placed`.
        processes: largest number of processes; by default the number of cores.

    Raises:
        UserError: for every error of the input.
        PlantFailedError: at the end, if an FMU failed meanwhile.
        HelperFailedError: see `run_part`; also if the process of a part has ended.

    """
    if clock == "follow-sync":
        raise UserError("several actuators have no common SYNC: use --clock wall or lockstep")
    if processes not in (None, 1) and not can_fork():
        raise UserError(f"--processes {processes}: only Linux divides a machine; leave it out")
    broken = [placed(line, [a.name for a in settings.actuators]) for line in faults]
    order = MachineRun(clock, duration, recording, broken)
    check_machine(settings, recording)
    with waiting(PREPARING):
        prepare(settings, cache_folder())  # before a client can connect, once for all processes
    click.echo(f"hil-emulator {__version__}  {len(settings.actuators)} actuators")
    divided = parts(settings, processes or usable_cores())
    if len(divided) > 1:
        run_parts(divided, order)
    else:
        run_part(settings, order, Terminal(), lambda: click.echo("Ctrl-C ends."))


def placed(line: str, names: Sequence[str]) -> tuple[str, Fault]:
    """Return the actuator and the fault of a line such as `hip.pressure_a offset value="3 bar"`.

    Raises:
        UserError: for a line without an actuator, or with an impossible fault.

    """
    for name in names:
        if line.startswith(f"{name}."):
            return name, spoken(line.removeprefix(f"{name}."))
    raise UserError(
        f"fault '{line}': begin with the name of an actuator, such as {names[0]}.{line}; "
        f"there are: {', '.join(names)}"
    )
