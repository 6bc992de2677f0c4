"""`hil-emulator hide`: a practice ground for `identify`, its truth in a sealed file."""

import csv
import re
import secrets
import shutil
import warnings
from collections.abc import Sequence
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
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.measured.reading import SET_POINT
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.panel.result_folder import result_of
from hil_emulator.platform.paths import cache_folder, near, shipped
from hil_emulator.units import factor

NOTHING = "nothing"
"""Said in place of an effect: the machine deviates, drifts and is noisy, and lacks nothing."""

SHORTEST, UNEVEN = 1e-5, 0.02
"""Sample period of a stimulus [s], and by how much of it a step may differ (assumed)."""

_SHOWN = {SET_POINT: ("A", "mA")} | {c.name: (c.unit, c.shown) for c in CHANNELS}


def hide(
    effects: Sequence[str], sizes: Sequence[str], configs: Sequence[Path], seed: int | None,
    surprise: bool, duration: float | None, out: Path,
) -> None:  # fmt: skip
    """Write experiments of a machine with effects hidden in it.

    Args:
        effects: their names; or `nothing`.
        sizes: one for all of them, or one each.
        configs: the plain configuration; the reference machine without any.
        seed: of everything that is drawn; another one each time without it.
        surprise: whether to draw the effect.
        duration: of each experiment [s]; the usual ones without it.
        out: the folder.

    Raises:
        UserError: for whatever the user can mend.

    """
    if surprise == bool(effects):
        raise UserError("name effects to hide (see `hil-emulator effects`), or take --surprise")
    if len(sizes) not in (1, max(1, len(effects))):
        raise UserError(f"{len(sizes)} sizes for {len(effects)} effects; give one, or one each")
    if (out / sealed.NAME).exists():
        raise UserError(f"{out}: something is hidden there already; name another folder")
    chosen = secrets.randbelow(2**31) if seed is None else seed
    config = _copied(list(configs) or [shipped("configs/hyq_knee.toml")], out)
    with waiting("hide", config.files):
        model = PlantModel(config, cache_folder())
        if surprise:
            hidden = [practice.surprise(model, sizes[0], chosen)]
        else:
            each = sizes if len(sizes) > 1 else [sizes[0]] * len(effects)
            pairs = zip(effects, each, strict=True)
            hidden = [practice.hide(model, e, s) for e, s in pairs if e != NOTHING]
        ground = practice.ground(model, hidden, chosen)
        for part, names in (("training", practice.TRAINING), ("validation", practice.VALIDATION)):
            first = 0 if part == "training" else len(practice.TRAINING)
            for i, e in enumerate(practice.campaign(ground, names, duration, first)):
                _write(e, out / part / f"{i + 1:02d}_{e.name}.csv")
    digest = sealed.seal(ground, out)
    if not surprise:
        for h in hidden:
            click.echo(f"hidden    {h}")
    click.echo(f"written   {near(out)}: training, validation, {sealed.NAME} (sha256 {digest})")
    click.echo(_next(config, out))


def play(file: Path, out: Path) -> None:
    """Record one more experiment of a practice ground, for training.

    Raises:
        UserError: if the file is no stimulus, or the folder no practice ground.

    """
    truth = sealed.unseal(out)
    config = load_whole(_configurations(out))
    ground = sealed.restored(PlantModel(config, cache_folder()), truth)
    number = len(list((out / "training").glob("*.csv"))) + 1
    made = _stimulus(file, ground)
    target = out / "training" / f"{number:02d}_{file.stem}.csv"
    _write(ground.record(made, 100 + number, file.stem), target)
    click.echo(f"recorded  {near(target)}")
    click.echo(_next(config, out))


def reveal(out: Path) -> None:
    """Print what is hidden, and how an identification did that has been there.

    Raises:
        UserError: if the folder is no practice ground.

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


def _next(config: Configuration, out: Path) -> str:
    """Return the command that looks for what is hidden."""
    files = " ".join(near(f) for f in config.files)
    return (
        f"next      hil-emulator identify {files} {near(out / 'training')}/*.csv \\\n"
        f"              --validate {near(out / 'validation')}/*.csv --out {near(out / 'found')}\n"
        f"then      hil-emulator hide --open {near(out)}"
    )


def _configurations(out: Path) -> list[Path]:
    found = sorted(out.glob("[0-9][0-9]_*.toml"))
    if not found:
        raise UserError(f"{out}: its configuration is missing; hide the effects again")
    return found


def _copied(configs: Sequence[Path], out: Path) -> Configuration:
    """Copy a configuration and the files that it names, so that the folder stands alone."""
    load_whole(configs)
    try:
        for part in ("training", "validation"):
            (out / part).mkdir(parents=True, exist_ok=True)
        copies = []
        for i, file in enumerate(configs):
            copies.append(out / f"{i + 1:02d}_{file.name}")
            copies[-1].write_text(_with_companions(file, out), encoding="utf-8")
    except OSError as error:
        raise UserError(f"{out}: cannot be written: {error}") from None
    return load_whole(copies)


def _with_companions(file: Path, out: Path) -> str:
    """Return a configuration's text that names copies of its EDS and effect files in `out`."""
    text = file.read_text(encoding="utf-8")
    for path in sorted(set(re.findall(r'"([^"\n]+\.(?:eds|py))"', text))):
        source = file.parent / path
        if source.is_file():
            shutil.copyfile(source, out / source.name)
            text = text.replace(f'"{path}"', f'"{source.name}"')
    return text


def _write(e: Experiment, file: Path) -> None:
    """Write a recording as a data logger would."""
    names = [SET_POINT, *e.readings]
    columns = [np.arange(e.samples) * e.period]
    columns += [v / factor(*_SHOWN[n]) for n, v in ((SET_POINT, e.current), *e.readings.items())]
    rows = np.column_stack(columns)
    try:
        with file.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            writer.writerow(["time [s]", *(f"{n} [{_SHOWN[n][1]}]" for n in names)])
            writer.writerows([f"{v:.9g}" for v in row] for row in rows.tolist())
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror}") from None


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
            f"{file}: no stimulus: {error}; write one with `hil-emulator experiment NAME`"
        ) from None
    allowed = limits(ground.model.plant_values)
    if position.min() < 0.0 or position.max() > ground.model.plant_values["cylinder_stroke"]:
        raise UserError(f"{file}: leaves the stroke of this cylinder; take a smaller amplitude")
    jumps = bool(np.max(np.abs(np.diff(position))) / period > 2.0 * allowed.speed)
    entry = Stimulus(file.stem, "from a file", "", lambda t, _: t, 1.0, jumps=jumps)
    return Target(entry, float(np.ptp(position)) / 2.0, time, position)
