"""Cost of the panel: lateness of the loop's ticks without it and with one or more pages open."""

import asyncio
import json
import multiprocessing
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil_emulator.protocol.stream import offset

PAGES = (None, 0, 1, 4)
"""Numbers of open pages to measure; None is a run without a panel."""
_SIGNALS = "position model.position load_force pressure_a pressure_b supply_pressure valve_current"
_STAMP = struct.Struct("<d")
_LATENESS = re.compile(r"lateness\s+p50 (\d+) us, p99 (\d+) us, p99.9 (\d+) us, max (\d+) us")
_START_S = 3.0  # time for pages to open, not measured


@dataclass(frozen=True)
class PanelCost:
    """The cost of a panel.

    Attributes:
        pages: number of open pages; None without a panel.
        lateness_us: p50, p99, p999 and max of the ticks' lateness [us].
        latency_ms: p50 and p99 of the age of a message's newest tick when a page receives it [ms].
        frames_per_s: messages that one page receives per second.

    """

    pages: int | None
    lateness_us: dict[str, float]
    latency_ms: dict[str, float]
    frames_per_s: float


def measure_panel(
    files: Sequence[Path], duration: float, report: Callable[[str], None]
) -> list[PanelCost]:
    """Run the emulator once for each number of pages; each run takes `duration` [s]."""
    costs = []
    for pages in PAGES:
        report("without a panel ..." if pages is None else f"{pages} pages ...")
        costs.append(_run(files, duration, pages))
    return costs


def _run(files: Sequence[Path], duration: float, pages: int | None) -> PanelCost:
    command = [sys.executable, "-m", "hil_emulator", "run", *map(str, files)]
    options = ["--bus", "virtual:bench", "--duration", f"{duration + _START_S:g} s"]
    emulator = subprocess.Popen(
        [*command, *options, *(["--panel"] if pages is not None else [])],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert emulator.stdout is not None
    output = ""
    for line in emulator.stdout:
        output += line
        if line.startswith("Ctrl-C"):
            break
    address = re.search(r"http://(\S+)/#(\S+)", output)
    ages: list[float] = []
    if address and pages:
        where = f"ws://{address[1]}/stream?token={address[2]}"
        # pages run in other processes, as browsers do
        with multiprocessing.get_context("spawn").Pool(pages) as pool:
            ages_of_pages = pool.starmap(_page, [(where, duration)] * pages)
            ages = [age for each in ages_of_pages for age in each]
    output += emulator.communicate()[0]
    late = _LATENESS.search(output)
    assert late is not None
    names = ("p50", "p99", "p999", "max")
    spread = np.percentile(ages, (50, 99)) if ages else (0.0, 0.0)
    return PanelCost(
        pages,
        {name: float(value) for name, value in zip(names, late.groups(), strict=True)},
        {"p50": float(spread[0]) * 1e3, "p99": float(spread[1]) * 1e3},
        len(ages) / max(1, pages or 1) / duration,
    )


def _page(where: str, duration: float) -> list[float]:
    """Receive messages for `duration` [s] as a page does; return the age of each message [s]."""
    return asyncio.run(_look(where, duration))


async def _look(where: str, duration: float) -> list[float]:
    from websockets.asyncio.client import connect

    view = {"do": "view", "columns": _SIGNALS, "span": 10, "pixels": 800, "generation": 1}
    ages = []
    async with connect(where, max_size=None) as connection:
        await connection.send(json.dumps(view))
        end = time.monotonic() + duration
        while time.monotonic() < end:
            message = await connection.recv()
            if isinstance(message, bytes):
                ages.append(time.monotonic() - _STAMP.unpack_from(message, offset("written"))[0])
    return ages
