"""`hil-emulator characterise`: bench tests on the emulated actuator."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.characterise.registry import LONGEST_STEP, characterise, chosen
from hil_emulator.characterise.result import Comparison, grouped
from hil_emulator.characterise.stand import Bench
from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import waiting
from hil_emulator.config.assumed import moved_defaults
from hil_emulator.config.load import Configuration, load_whole
from hil_emulator.model.constants import S1, S2
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.effects.lines import pressure_compensator
from hil_emulator.model.kernel import build
from hil_emulator.platform.paths import cache_folder, near

_HEADER = ("test", "quantity", "unit", "expected", "emulator", "difference", "verdict",
           "rests on an assumed")  # fmt: skip


def run(
    test: str, files: Sequence[Path], out: Path, seed: int | None, *, overwrite: bool = False
) -> None:
    """Perform one bench test, or all, and write tables, pictures and a page.

    Raises:
        UserError: for an unknown test, a wrong configuration or a file that exists or cannot be
            written.

    """
    config = load_whole(files)
    chosen([test])  # an unknown test is refused before anything is compiled
    with waiting(f"characterise {test}", files) as progress:
        bench = Bench(
            build(config.effects, cache_folder()), config.plant, config.sensors,
            config.seed if seed is None else seed, min(config.step, LONGEST_STEP),
        )  # fmt: skip
        results = characterise(
            [test], bench, out, progress.report, overwrite=overwrite, moved=moved_defaults(config)
        )
    for group in grouped(results):
        click.echo(f"{group.summary}\n{text_table(_HEADER, map(_row, group.rows))}\n")
    driven = [e.name for e in config.effects if e.stage.table == "driver" and _acts(e, config)]
    if driven:
        click.echo(f"left out: {', '.join(driven)} of [driver]; the tests command the coil\n")
    if _acts(pressure_compensator, config):
        click.echo("left out: pressure_compensator of [lines]; the tests measure the spool\n")
    reasons = [(r.name, reason) for r in results for reason in r.inapplicable]
    if reasons:
        click.echo(f"does not apply:\n{text_table(('test', 'reason'), reasons)}\n")
    click.echo(f"{S1}\n{S2}\n")
    click.echo(f"written to {near(out)}: open {near(out / 'index.html')}")


def _acts(effect: Effect, config: Configuration) -> bool:
    return is_on(effect, config.plant.get(effect.field_of(effect.knob), effect.off))


def _row(row: tuple[str, Comparison]) -> tuple[str, ...]:
    test, c = row
    return (
        test,
        c.quantity,
        c.unit,
        f"{c.expected:.5g}",
        f"{c.measured:.5g}",
        f"{c.difference:+.2%}",
        "agrees" if c.agrees else "DIFFERS",
        ", ".join(c.rests_on),
    )
