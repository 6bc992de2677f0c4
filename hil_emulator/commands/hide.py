"""`hil-emulator hide`: logs with hidden effects for practice with `identify`."""

import csv
import hashlib
import re
import secrets
import shutil
import warnings
from collections.abc import Sequence
from itertools import count
from pathlib import Path

import click
import numpy as np

from hil_emulator import input_files
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.load import Configuration, load_whole
from hil_emulator.errors import UserError
from hil_emulator.identify.experiment_design import practice, sealed
from hil_emulator.identify.experiment_design.library import Stimulus, Target, limits
from hil_emulator.identify.experiment_design.practice import Ground
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.panel.result_folder import result_of
from hil_emulator.platform.output_files import Staging, new_files, refuse_existing
from hil_emulator.platform.paths import cache_folder, near, shipped
from hil_emulator.units import axis, factor, read_as

NOTHING = "nothing"
"""Name for no hidden effect: the machine deviates, drifts and is noisy, but lacks nothing."""

SHORTEST, UNEVEN = 1e-5, 0.02
"""Sample period of a stimulus [s], and the relative tolerance of a step (assumed)."""

PARTS = {"training": practice.TRAINING, "validation": practice.VALIDATION}
"""Folders of the logs, and the experiments in them."""

_SHOWN = {SET_POINT: ("A", "mA")} | {c.name: (c.unit, c.shown) for c in CHANNELS}


def hide(
    effects: Sequence[str], sizes: Sequence[str], configs: Sequence[Path], seed: int | None,
    surprise: bool, duration: float | None, out: Path, *, overwrite: bool = False,
) -> None:  # fmt: skip
    """Write experiments of a machine with hidden effects.

    Args:
        effects: their names; or `nothing`.
        sizes: one for all of them, or one each.
        configs: the plain configuration; the reference machine without any.
        seed: of all random numbers; by default a new one each time.
        surprise: whether to draw the effect.
        duration: of each experiment [s]; the usual ones without it.
        out: the folder.
        overwrite: whether an existing practice folder is replaced.

    Raises:
        UserError: for every error of the input; no file is written then.

    """
    if surprise == bool(effects):
        raise UserError("name effects to hide (see `hil-emulator effects`), or take --surprise")
    if len(sizes) not in (1, max(1, len(effects))):
        raise UserError(f"{len(sizes)} sizes for {len(effects)} effects; give one, or one each")
    files = list(configs) or [shipped("configs/hyq_knee.toml")]
    rotary = load_whole(files).rotary
    refuse_existing([out / sealed.NAME, *_copies(files, out)], overwrite=overwrite)
    _refuse_other_logs(out)
    chosen = secrets.randbelow(2**31) if seed is None else seed
    with axis(rotary=rotary), new_files(overwrite=overwrite) as staged:
        config = _copied(files, out, staged)
        with waiting("hide", config.files):
            model = PlantModel(config, cache_folder())
            if surprise:
                hidden = [practice.surprise(model, sizes[0], chosen)]
            else:
                each = sizes if len(sizes) > 1 else [sizes[0]] * len(effects)
                pairs = zip(effects, each, strict=True)
                hidden = [practice.hide(model, e, s) for e, s in pairs if e != NOTHING]
            ground = practice.ground(model, hidden, chosen)
            _write_logs(ground, duration, out, staged)
        truth = sealed.seal(ground)
        staged(out / sealed.NAME).write_text(truth, encoding="ascii")
        words = [str(h) for h in hidden if not surprise]
    for line in words:
        click.echo(f"hidden    {line}")
    digest = hashlib.sha256(truth.encode()).hexdigest()
    click.echo(f"written   {near(out)}: {', '.join(PARTS)}, {sealed.NAME} (sha256 {digest})")
    click.echo(_next(_copies(files, out), out))


def play(file: Path, out: Path) -> None:
    """Record one more experiment in a practice folder, for training.

    Raises:
        UserError: if the file is not a stimulus, the folder not a practice folder, or the log
            cannot be written.

    """
    truth = sealed.unseal(out)
    copies = _configurations(out)
    ground = sealed.restored(PlantModel(load_whole(copies), cache_folder()), truth)
    logs = [log.name for log in (out / "training").glob("*.csv")]
    free = (n for n in count(len(logs) + 1) if not any(x.startswith(f"{n:02d}_") for x in logs))
    number = next(free)
    target = out / "training" / f"{number:02d}_{file.stem}.csv"
    made = _stimulus(file, ground)
    with axis(rotary=ground.model.config.rotary), new_files() as staged:
        _write(ground.record(made, 100 + number, file.stem), staged(target))
    click.echo(f"recorded  {near(target)}")
    click.echo(_next(copies, out))


def reveal(out: Path) -> None:
    """Print the hidden effects, and compare them with a result in the folder.

    Raises:
        UserError: if the folder is not a practice folder.

    """
    truth = sealed.unseal(out)
    for e in truth["effects"] or [None]:
        words = f"{e['name']}: {e['knob']} = {e['value']:.6g} {e['unit']}" if e else NOTHING
        click.echo(f"hidden    {words}")
    for file in (out / "found" / "result.json", out / "result.json"):
        if file.is_file():
            result = result_of(file)
            click.echo(f"result    {near(file)}: {result['verdict']}")
            click.echo("\n".join(sealed.compared(truth, result)))
            return
    click.echo(f"no result yet in {near(out / 'found')}")


def _next(configs: Sequence[Path], out: Path) -> str:
    """Return the command that searches the hidden effects."""
    files = " ".join(map(near, configs))
    return (
        f"next      hil-emulator identify {files} {near(out / 'training')}/*.csv \\\n"
        f"              --validate {near(out / 'validation')}/*.csv --out {near(out / 'found')}\n"
        f"then      hil-emulator hide --open {near(out)}"
    )


def _configurations(out: Path) -> list[Path]:
    copies = sorted(out.glob("[0-9][0-9]_*.toml"))
    if not copies:
        raise UserError(f"{out}: its configuration is missing; hide the effects again")
    return copies


def _copies(configs: Sequence[Path], out: Path) -> list[Path]:
    """Return the files for the copies of the configuration."""
    return [out / f"{i:02d}_{file.name}" for i, file in enumerate(configs, 1)]


def _logs(out: Path, part: str) -> list[Path]:
    """Return the logs of a part of the practice folder."""
    return [out / part / f"{i:02d}_{name}.csv" for i, name in enumerate(PARTS[part], 1)]


def _refuse_other_logs(out: Path) -> None:
    """Refuse a folder with logs that could be confused with the new ones.

    Raises:
        UserError: names one of them.

    """
    for part in PARTS:
        for file in sorted({*(out / part).glob("*.csv")} - {*_logs(out, part)}):
            raise UserError(
                f"{file}: could be confused with a log of the new practice; move it away, or "
                "name another folder"
            )


def _copied(configs: Sequence[Path], out: Path, staged: Staging) -> Configuration:
    """Copy a configuration and the files that it names, so that the folder is self-contained."""
    copies, companions = [], dict[Path, Path]()
    for file, copy in zip(configs, _copies(configs, out), strict=True):
        text, named = _with_companions(file, out)
        copies.append(staged(copy))
        copies[-1].write_text(text, encoding="utf-8")
        companions |= named
    for copy, source in companions.items():
        shutil.copyfile(source, staged(copy))
    return load_whole(copies)


def _with_companions(file: Path, out: Path) -> tuple[str, dict[Path, Path]]:
    """Return a configuration's text that names EDS and effect files in `out`, and their sources."""
    text = file.read_text(encoding="utf-8")
    sources = {}
    for path in sorted(set(re.findall(r'"([^"\n]+\.(?:eds|py))"', text))):
        source = file.parent / path
        if source.is_file():
            sources[out / source.name] = source
            text = text.replace(f'"{path}"', f'"{source.name}"')
    return text, sources


def _write_logs(ground: Ground, duration: float | None, out: Path, staged: Staging) -> None:
    """Write the experiments."""
    first = 0
    for part, names in PARTS.items():
        played = practice.campaign(ground, names, duration, first)
        for file, e in zip(_logs(out, part), played, strict=True):
            _write(e, staged(file))
        first += len(names)


def _write(e: Experiment, file: Path) -> None:
    """Write a recording as a data logger would."""
    names = [SET_POINT, *e.readings]
    units = {n: (_SHOWN[n][0], read_as(*_SHOWN[n])) for n in names}
    columns = [np.arange(e.samples) * e.period]
    columns += [v / factor(*units[n]) for n, v in ((SET_POINT, e.current), *e.readings.items())]
    rows = np.column_stack(columns)
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time [s]", *(f"{n} [{units[n][1]}]" for n in names)])
        writer.writerows([f"{v:.9g}" for v in row] for row in rows.tolist())


def _stimulus(file: Path, ground: Ground) -> Target:
    """Read a stimulus file of `hil-emulator experiment`."""
    try:
        input_files.check(file, input_files.COURSE)
        with warnings.catch_warnings(action="ignore"):  # of a file without rows
            time, position = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2).T
        steps = np.diff(time)
        period = float(np.median(steps)) if len(steps) else 0.0
        even = np.all(np.abs(steps - period) < UNEVEN * period)
        if not (even and period >= SHORTEST and np.isfinite(position).all()):
            raise ValueError(f"its times do not rise evenly by {SHORTEST:g} s or more")
    except (OSError, ValueError) as error:
        raise UserError(
            f"{file}: not a stimulus: {error}; write one with `hil-emulator experiment NAME`"
        ) from None
    allowed = limits(ground.model.plant_values)
    if position.min() < 0.0 or position.max() > ground.model.plant_values["cylinder_stroke"]:
        raise UserError(f"{file}: leaves the stroke of this cylinder; take a smaller amplitude")
    jumps = bool(np.max(np.abs(np.diff(position))) / period > 2.0 * allowed.speed)
    entry = Stimulus(file.stem, "from a file", "", lambda t, _: t, 1.0, jumps=jumps)
    return Target(entry, float(np.ptp(position)) / 2.0, time, position)
