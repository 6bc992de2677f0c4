"""`hil-emulator bench`: what this machine achieves."""

import dataclasses
import json
from pathlib import Path

import click

from hil_emulator.bench.speed import Speeds, measure
from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import load
from hil_emulator.places import cache_folder, shipped


def bench(files: tuple[Path, ...], duration: float, as_json: bool) -> None:
    """Measure and print.

    Raises:
        UserError: if the configuration is wrong.

    """
    config = load(files or (shipped("configs/hyq_knee.toml"),))
    speeds = measure(config, cache_folder(), duration, lambda text: click.echo(text, err=True))
    if as_json:
        click.echo(json.dumps(dataclasses.asdict(speeds), indent=2))
    else:
        click.echo(_table(speeds, duration))


def _spread(us: dict[str, float]) -> str:
    return ", ".join(f"{key} {value:.0f}" for key, value in us.items())


def _table(s: Speeds, duration: float) -> str:
    rows = [
        ("integration step (RK4) [us]", f"{s.rk4_step_us:.2f}"),
        ("the same, all effects on [us]", f"{s.rk4_step_all_us:.2f}"),
        ("tick in lock-step [us]", _spread(s.tick_us)),
        ("lock-step over real time", f"{s.lockstep_x:.1f}"),
        (f"tick under the wall clock, {duration:g} s [us]", _spread(s.execution_us)),
        ("lateness under the wall clock [us]", _spread(s.lateness_us)),
        ("ticks a period late or more", str(s.overruns)),
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
    ]
    table = text_table(("measured", "value"), rows)
    return f"{table}\nunder the wall clock: {'; '.join(s.realtime)}"
