"""`hil-emulator bench`: measure what this machine achieves."""

import dataclasses
import json
from pathlib import Path

import click

from hil_emulator.bench.effect_cost import measure_effects
from hil_emulator.bench.finding import SearchCost, measure_finding
from hil_emulator.bench.panel_cost import PanelCost, measure_panel
from hil_emulator.bench.speed import Speeds, measure
from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.load import load_rig
from hil_emulator.panel.server_process import require_server
from hil_emulator.platform.paths import cache_folder, shipped


def bench(
    files: tuple[Path, ...], duration: float, identify: float | None, as_json: bool,
    panel: bool = False,
) -> None:  # fmt: skip
    """Measure and print.

    Args:
        files: the configuration; the reference machine without any.
        duration: of the wall-clock part [s].
        identify: length of the data for a search, which replaces all other measurements [s].
        as_json: whether to print JSON.
        panel: whether to measure the cost of the panel instead of everything else.

    Raises:
        UserError: if the configuration is wrong.

    """
    chosen = _chosen(files)
    config = load_rig(chosen)
    if panel:
        require_server()
        with waiting(f"bench --panel {duration:g} s", chosen, json=as_json) as progress:
            costs = measure_panel(chosen, duration, progress.report)
        plain = json.dumps([dataclasses.asdict(cost) for cost in costs], indent=2)
        click.echo(plain if as_json else _panel_table(costs))
        return
    measured: Speeds | SearchCost
    if identify:
        with waiting(f"bench --identify {identify:g} s", chosen, json=as_json) as progress:
            measured = measure_finding(chosen, identify, progress.report)
        table = _found(measured)
    else:
        with waiting(f"bench {duration:g} s", chosen, json=as_json) as progress:
            measured = measure(config, cache_folder(), duration, progress.report)
        table = _table(measured, duration)
    click.echo(json.dumps(dataclasses.asdict(measured), indent=2) if as_json else table)


def bench_effects(files: tuple[Path, ...], as_json: bool) -> None:
    """Measure the time that each effect of the plant adds to a step; arguments as `bench`."""
    chosen = _chosen(files)
    with waiting("bench --effects", chosen, json=as_json) as progress:
        costs = measure_effects(load_rig(chosen), cache_folder(), progress.report)
    rows = [(c.effect, f"{c.step_us:.2f}", f"{c.relative:.2f}") for c in costs]
    plain = json.dumps([dataclasses.asdict(cost) for cost in costs], indent=2)
    titles = ("effect, alone on", "step [us]", "over a step without")
    click.echo(plain if as_json else text_table(titles, rows))


def _chosen(files: tuple[Path, ...]) -> tuple[Path, ...]:
    return files or (shipped("configs/hyq_knee.toml"),)


def _found(f: SearchCost) -> str:
    p = f.phases
    rows = [
        (f"identify in {f.data_s:g} s of data, one thread [s]", f"{f.alone_s:.0f}"),
        ("most memory [MB]", f"{f.alone_mb:.0f}"),
        (f"{f.jobs} threads [s]", f"{f.shared_s:.0f}"),
        ("times as fast", f"{f.alone_s / f.shared_s:.2f}"),
        ("most memory [MB]", f"{f.shared_mb:.0f}"),
        ("under the profiler: the search [s]", f"{p.whole_s:.0f}"),
        *((f"  {name} [s]", f"{s:.1f}") for name, s in p.phases_s.items()),
        *((f"  arithmetic of {name} [s]", f"{s:.1f}") for name, s in p.arithmetic_s.items()),
        ("  over its arithmetic", f"{p.over_arithmetic:.2f}"),
        ("predictions of an experiment", f"{p.predictions}"),
        ("fits", f"{p.fits}"),
    ]
    return text_table(("measured", "value"), rows)


def _panel_table(costs: list[PanelCost]) -> str:
    rows = [
        (
            "no panel" if c.pages is None else f"{c.pages} pages",
            _spread(c.lateness_us),
            _spread(c.latency_ms) if c.pages else "",
            f"{c.frames_per_s:.0f}" if c.pages else "",
        )
        for c in costs
    ]
    titles = ("open", "lateness of the loop [us]", "tick to page [ms]", "frames/s")
    return text_table(titles, rows)


def _if_compiled(duration_us: float | None) -> str:
    """Return a duration of compiled C in words."""
    return "no compiler" if duration_us is None else f"{duration_us:.2f}"


def _spread(us: dict[str, float]) -> str:
    return ", ".join(f"{key} {value:.0f}" for key, value in us.items())


def _system(p99_us: float | None) -> str:
    return "not installed (package rt-tests)" if p99_us is None else f"p99 {p99_us:.0f}"


def _table(s: Speeds, duration: float) -> str:
    cores = s.fleet_on_cores
    rows = [
        ("start of a run, empty cache [s]", f"{s.start.cold_s:.1f}"),
        ("start of a run [s]", f"{s.start.warm_s:.2f}"),
        ("its memory [MB]", f"{s.start.memory_mb:.0f}"),
        ("integration step (RK4) [us]", f"{s.rk4_step_us:.2f}"),
        ("the same in C [us]", _if_compiled(s.rk4_step_c_us)),
        ("the same, all effects on [us]", f"{s.rk4_step_all_us:.2f}"),
        ("that in C [us]", _if_compiled(s.rk4_step_all_c_us)),
        ("the same, each of two on one supply [us]", f"{s.rk4_step_shared_us:.2f}"),
        ("tick in lock-step [us]", _spread(s.tick_us)),
        ("recording to a file, of a tick [us]", _spread(s.recording_us)),
        ("lock-step over real time", f"{s.lockstep_x:.1f}"),
        ("digest of its frames", s.frames_sha256[:16]),
        (f"tick under the wall clock, {duration:g} s [us]", _spread(s.execution_us)),
        ("lateness under the wall clock [us]", _spread(s.lateness_us)),
        ("ticks a period late or more", str(s.overruns)),
        ("tick without a TCP client [us]", _spread(s.client.idle_us)),
        ("tick with a TCP client at 1 kHz [us]", _spread(s.client.execution_us)),
        ("lateness with it [us]", _spread(s.client.lateness_us)),
        ("lateness of cyclictest [us]", _system(s.client.system_us)),
        ("highest rate held with it [Hz]", str(s.client.held_hz)),
        ("frames through TCP [1/s]", f"{s.tcp_frames_per_s:.0f}"),
        (
            f"{s.fleet.nodes} nodes, 4 buses of {s.fleet.pdos_per_ms:.1f} frames/ms: lock-step",
            f"{s.fleet.lockstep_x:.1f}",
        ),
        (
            "their tick [us]",
            f"{s.fleet.tick_us:.0f}: plants {s.fleet.plant_us:.0f}, bus {s.fleet.bus_us:.0f}, "
            f"sensors and nodes {s.fleet.rest_us:.0f}",
        ),
        (
            f"{s.full_buses.nodes} combined nodes, 4 buses of {s.full_buses.pdos_per_ms:.1f} "
            "frames/ms: lock-step",
            f"{s.full_buses.lockstep_x:.1f}",
        ),
        (
            f"both in {cores.processes} processes",
            f"{cores.lockstep_x:.1f}, {cores.combined_x:.1f}",
        ),
        (
            f"{cores.held} actuators under the wall clock, p99 [us]",
            f"tick {cores.execution_us:.0f}, lateness {cores.lateness_us:.0f}; "
            f"{cores.late} of {cores.ticks} a period late or more",
        ),
    ]
    table = text_table(("measured", "value"), rows)
    return f"{table}\nunder the wall clock: {'; '.join(s.realtime)}"
