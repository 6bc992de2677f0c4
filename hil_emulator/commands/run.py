"""`hil-emulator run`: the emulator on a bus, until its time is over or Ctrl-C."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.commands.live import Terminal
from hil_emulator.commands.live_play import LivePlay
from hil_emulator.commands.recording import NOT_RECORDED, RecordOptions, recorded
from hil_emulator.commands.run_machine import run_machine
from hil_emulator.commands.run_on_bus import PLAIN, Extent, Operation, on_bus
from hil_emulator.commands.run_scenario import ScenarioOptions, play_runs
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.bus import DEFAULT_BUS
from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import spoken
from hil_emulator.panel.server_process import PanelOptions, require_server
from hil_emulator.platform.paths import cache_folder
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.simulation.machine import prepare
from hil_emulator.units import axis


def run(
    files: Sequence[Path],
    bus: str | None,
    clock: str,
    duration: float | None,
    recording: RecordOptions = NOT_RECORDED,
    faults: Sequence[str] = (),
    operation: Operation = PLAIN,
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
    runs = scenario.runs(files) if scenario else []
    settings = load_machine(scenario.configuration(files) if scenario else files)
    if len(settings.actuators) > 1:
        _check_machine(bus, operation, scenario)
        with axis(rotary=any(a.config.rotary for a in settings.actuators)):
            run_machine(settings, clock, duration, recording, faults, operation.processes)
        return 0
    if len(runs) > 1 and (operation.panel or operation.control):
        raise UserError("--panel and --control show one run; this scenario has several")
    recording.check()
    config = settings.actuators[0].config
    with axis(rotary=config.rotary):
        injected = [spoken(line) for line in faults]
    settings_of_bus = bus_settings(config, bus, operation.port)
    with waiting(PREPARING):
        prepare(settings, cache_folder())  # before a client can connect
    with (
        axis(rotary=config.rotary),
        Supervisor(Terminal().warn) as supervisor,
        Bus(settings_of_bus) as bus_port,
    ):

        def run_once(
            play: LivePlay | None, config: Configuration, recording: RecordOptions
        ) -> None:
            recorder = partial(recorded, config=config, options=recording, supervisor=supervisor)
            extent = Extent(clock, duration, injected, play)
            on_bus(bus_port, config, extent, recorder, operation, supervisor)

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
