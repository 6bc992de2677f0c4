"""`hil-emulator export-fmu`: plant and sensors as an FMU, or as C."""

import re
from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.ccode.c_types import TranslationError
from hil_emulator.ccode.plant_source import Exported, sources
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.load import Configuration, load_whole
from hil_emulator.errors import UserError
from hil_emulator.fmi.exporting.archive import write_fmu
from hil_emulator.platform.output_files import new_files, refuse_existing, write_texts
from hil_emulator.platform.paths import near
from hil_emulator.simulation.active_effects import acting


def export_fmu(
    files: Sequence[Path], out: Path | None, version: int, *, c_only: bool, single: bool,
    every_effect: bool, native: bool = False, overwrite: bool = False,
) -> None:  # fmt: skip
    """Write an FMU, or a header and a source file.

    Args:
        files: the configuration.
        out: the FMU, or for C the file without its ending; named as the first file without it.
        version: of FMI, 2 or 3.
        c_only: write C only.
        single: compute with float instead of double; for C only.
        every_effect: include effects that are off, so that they can be switched on.
        native: compile for this system only.
        overwrite: whether files that exist are replaced.

    Raises:
        UserError: if the configuration is wrong, an effect has no C, or a file exists or cannot be
            written.

    """
    if single and not c_only:
        raise UserError("--float32 is for --c-only: an FMU's numbers are of 64 bit")
    stem = out.with_suffix("") if out else Path(files[0].stem)
    written = [stem.with_suffix(ending) for ending in ((".h", ".c") if c_only else (".fmu",))]
    refuse_existing(written, overwrite=overwrite)
    config = load_whole(files)
    actuator = actuator_of(config if every_effect else acting(config), stem.name)
    try:
        if c_only:
            texts = dict(zip(written, sources(actuator, single=single), strict=True))
            write_texts(texts, overwrite=overwrite)
        else:
            with (
                waiting("export-fmu", files) as progress,
                new_files(overwrite=overwrite) as staged,
            ):
                write_fmu(actuator, version, staged(written[0]), progress.report, native=native)
    except TranslationError as error:
        raise UserError(
            f"{error} has no translation to C; write the law with arithmetic, if, for and math "
            "only, or leave its file out"
        ) from None
    for file in written:
        click.echo(near(file))


def actuator_of(config: Configuration, stem: str) -> Exported:
    """Return the actuator of a configuration, under a name that is valid in C."""
    name = re.sub(r"\W", "_", stem, flags=re.ASCII).lower()
    if not name or name[0].isdigit():
        name = f"plant_{name}"
    return Exported(
        name=name,
        title=f"hydraulic actuator of {', '.join(f.name for f in config.files)}",
        effects=config.effects,
        values=config.plant,
        sensors=config.sensors,
        step=config.step,
        steps=config.steps,
        seed=config.seed,
    )
