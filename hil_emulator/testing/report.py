"""Report of the emulator's state for a failing test."""

import re
from pathlib import Path

from hil_emulator.platform.output_files import new_files
from hil_emulator.platform.paths import near
from hil_emulator.recording import SUFFIX, journal
from hil_emulator.recording.messages import describe, messages
from hil_emulator.signals.columns import columns
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.units import axis, read_as, show

FRAMES = 20
"""Number of last frames in the report."""

FOLDER = ".hil-emulator"
"""Folder of the recordings of failed tests, below pytest's root folder."""


def frames(emulator: Emulator, count: int = FRAMES) -> list[str]:
    """Return the last frames in words, oldest first."""
    meanings = {m.identifier: m for m in messages(emulator.rig.nodes)}
    return [
        f"{now_ns * 1e-9:9.3f} s  {'out' if sent else 'in ':<3}  {frame.can_id:03X}  "
        f"{frame.data.hex(' '):<23}  {describe(frame, meanings)}".rstrip()
        for now_ns, sent, frame in emulator.recorder.frames[-count:]
    ]


def signals(emulator: Emulator) -> list[str]:
    """Return the present signals, a line each."""
    with axis(rotary=emulator.config.rotary):
        return [
            f"  {name:<28} {show(emulator.rig.value(name), unit, read_as(unit))}"
            for name, unit in columns().items()
        ]


def keep(emulator: Emulator, test: str, folder: Path) -> Path:
    """Write the test's recording over its last one, out of sight of Git; return its file."""
    name = re.sub(r"[^\w.-]+", "_", test.partition("::")[2] or test)
    file = folder / f"{name}{SUFFIX}"
    with new_files(overwrite=True) as staged:
        journal.write(emulator.recording(), staged(file))
    (folder / ".gitignore").write_text("*\n")
    return file


def _broken(emulator: Emulator) -> list[str]:
    """Return the faults and their ends; a `with` block ends its fault before this."""
    lines, faults = [], []
    for now_ns, what in emulator.recorder.events:
        if "fault" in what:
            options = dict(what["fault"])
            words = [f"{options.pop('target')} {options.pop('kind')}"]
            faults.append(
                ", ".join([*words, *(f"{name} {value}" for name, value in options.items())])
            )
            lines.append(f"  {now_ns * 1e-9:9.3f} s  {faults[-1]}")
        elif "end" in what:  # a rig counts its faults from 0
            lines.append(f"  {now_ns * 1e-9:9.3f} s  {faults[what['end']]} ended")
    return lines


def report(emulator: Emulator, test: str, file: Path) -> str:
    """Return the report of a failing test."""
    faults = _broken(emulator)
    seed = emulator.config.seed
    return "\n".join(
        [
            f"emulator time {emulator.now:.3f} s, seed {seed}",
            *(["faults:", *faults] if faults else []),
            f"last {FRAMES} frames:",
            *frames(emulator),
            "signals:",
            *signals(emulator),
            f"replay the frames:  hil-emulator replay {near(file)}",
            f"run the test again: pytest '{test}' --emulator-seed {seed}",
        ]
    )
