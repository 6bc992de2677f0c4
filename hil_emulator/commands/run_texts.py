"""Texts of `hil-emulator run`: the banner, the status line and the timed buses of the summary."""

from collections.abc import Sequence

from hil_emulator import __version__
from hil_emulator.bus.bus import Bus
from hil_emulator.can_timing.wire import TimedWire
from hil_emulator.commands.live import load, traffic
from hil_emulator.config.load import Configuration
from hil_emulator.platform.paths import near
from hil_emulator.simulation import realtime
from hil_emulator.simulation.loop import Timing
from hil_emulator.simulation.rig import Rig
from hil_emulator.units import factor, read_as


def banner(
    config: Configuration, rig: Rig, bus: Bus, clock: str, measures: Sequence[realtime.Measure]
) -> str:
    """Return the lines before the first tick.

    Args:
        config: of the rig.
        rig: that runs.
        bus: of the rig.
        clock: "wall", "lockstep" or "follow-sync".
        measures: taken for real time.

    """
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


def status(rig: Rig, timing: Timing, bus: Bus) -> str:
    """Return the status line."""
    y = rig.plant.signals
    states = ", ".join(f"{n.node_id} {n.state.name.lower()}" for n in rig.nodes)
    return (
        f"{rig.now_ns * 1e-9:9.1f} s  node {states}  x {_read(y.position, 'm'):>9}  "
        f"f {_read(y.load_force, 'N', 0):>9}  "
        f"pa {y.pressure_a * 1e-5:5.1f} pb {y.pressure_b * 1e-5:5.1f} bar  "
        f"{traffic([bus])}{load(wires(rig))}  late {timing.overruns}"
    )


def _read(value: float, unit: str, digits: int = 2) -> str:
    """Return a value in the unit of the axis, with a fixed number of digits."""
    shown = read_as(unit)
    return f"{value / factor(unit, shown):.{digits}f} {shown}"


def wires(rig: Rig) -> list[TimedWire]:
    """Return the buses of a rig whose frames take time."""
    return [rig.wire] if rig.wire else []
