"""`hil-emulator init`: the configuration of a user's machine."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.commands.waiting import PREPARING, waiting
from hil_emulator.config.json_schema import json_schema
from hil_emulator.config.load import load_rig
from hil_emulator.errors import UserError
from hil_emulator.machines import sizing
from hil_emulator.machines.node_sheet import electronic_data_sheet
from hil_emulator.machines.questions import (
    Answer,
    Answers,
    Inquiry,
    answered,
    number,
    piston_area,
    valve,
)
from hil_emulator.machines.valve_sheet import library
from hil_emulator.machines.writing import BULK_MODULUS, configuration
from hil_emulator.model.stability import required_step
from hil_emulator.platform.output_files import refuse_existing, write_texts
from hil_emulator.platform.paths import cache_folder, near, shipped
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import compiled
from hil_emulator.units import show

SCHEMA = "hil-emulator.schema.json"
"""Name of the JSON Schema next to a configuration."""

STEPS = (20e-6, 10e-6, 8e-6, 5e-6, 4e-6, 2e-6, 1e-6)
"""Integration steps that fit into a tick of 1 ms [s]. The longest is that of the reference machine,
up to which accuracy was measured."""


def init(file: Path, given: Mapping[str, str], *, ask: bool, overwrite: bool = False) -> None:
    """Ask for a machine and write its configuration, the EDS of its node and the JSON Schema.

    Args:
        file: the configuration.
        given: answers of the command line, by name of the question.
        ask: whether to ask the other questions; else their defaults are used.
        overwrite: whether existing files are replaced.

    Raises:
        UserError: for a wrong answer, a file that exists or cannot be written, or a machine that is
            too stiff to be integrated; no file is written then.

    """
    eds, schema = file.with_suffix(".eds"), file.with_name(SCHEMA)
    if file.suffix != ".toml":
        raise UserError(f"{file}: a configuration is TOML; call it {file.name}.toml")
    refuse_existing((file, eds), overwrite=overwrite)
    described = json.dumps(json_schema("configuration"), indent=1, ensure_ascii=False) + "\n"
    if not _holds(schema, described):
        refuse_existing([schema], overwrite=overwrite)
    if ask:
        click.echo('Enter accepts the value in brackets. Quantities have units, such as "40 mm".')
    answers = answered(given, _prompt if ask else default_answer)
    usual = shipped("eds/hydraulic_actuator.eds").read_text(encoding="utf-8")
    sheet = electronic_data_sheet(usual, eds.name, answers)
    click.echo("Looking for the integration step (some seconds the first time) ...", err=True)
    with TemporaryDirectory() as folder:
        trial = Path(folder) / file.name
        trial.with_suffix(".eds").write_text(sheet, encoding="utf-8")
        trial.write_text(configuration(answers, eds.name, SCHEMA, STEPS[0]), encoding="utf-8")
        try:
            step = _step(trial)
        except UserError as error:  # which names the trial's file
            raise UserError(str(error).replace(f"{folder}/", "")) from None
    text = configuration(answers, eds.name, SCHEMA, step)
    write_texts({eds: sheet, schema: described, file: text}, overwrite=overwrite)
    click.echo(_summary(answers, file, eds, schema))


def list_valves() -> None:
    """Print the library of valves."""
    rows = [
        (name, f"{v.get('nominal_flow') * 6e4:.3g}", f"{v.get(v.drop) * 1e-5:.3g} "
         + ("total" if v.drop == "pressure_drop_total" else "per edge"),
         f"{v.natural_frequency[0]:.0f}", v.title, v.sheet)
        for name, v in library().items()
    ]  # fmt: skip
    click.echo(text_table(("name", "l/min", "at bar", "Hz", "valve", "data sheet"), rows))


def _prompt(question: Inquiry, answers: Answers) -> Answer:
    """Ask until there is an answer."""
    if question.name == "valve":
        list_valves()
    while True:
        usual = question.written(question.usual(answers))
        text = click.prompt(question.text, default=usual)
        try:
            return question.read(text, answers)
        except ValueError as error:
            click.echo(f"  {error}")


def default_answer(question: Inquiry, answers: Answers) -> Answer:
    """Return the usual answer to a question, as a user would type it."""
    try:
        return question.read(question.written(question.usual(answers)), answers)
    except ValueError as error:
        raise UserError(f"{question.option}: the default does not fit: {error}") from None


def _step(file: Path) -> float:
    """Return the longest integration step that is safe for a configuration [s]."""
    lean = acting(load_rig([file]))
    with waiting(PREPARING):
        safe = required_step(compiled(lean.effects, cache_folder()), lean.plant)
    fitting = [step for step in STEPS if step <= safe]
    if not fitting:
        raise UserError(
            f"{file.name}: so stiff that it needs steps of {safe * 1e6:.2g} us; the shortest is "
            "1 us: take longer lines, or a valve of less flow"
        )
    return fitting[0]


def _holds(file: Path, text: str) -> bool:
    """Return whether a file has this content already."""
    try:
        return not file.is_symlink() and file.read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return False


def _speed(answers: Answers) -> str:
    """Return the extending speed without load, limited by valve or pump."""
    by_valve, by_pump = sizing.no_load_speed(answers), sizing.pump_speed(answers)
    if by_valve <= by_pump:
        return f"{by_valve:.3g} m/s, extending"
    pump = show(number(answers, "pump_flow"), "m^3/s", "l/min")
    once = ", once the accumulator is empty," if "precharge" in answers else ""
    return (
        f"{by_pump:.3g} m/s, extending, by the pump of {pump}\n"
        f"warning           the valve would pass {by_valve:.3g} m/s: at more than "
        f"{by_pump / by_valve:.2g} of its opening\n"
        f"                  the supply pressure falls{once}; take a larger pump or a smaller valve"
    )


def _summary(answers: Answers, file: Path, eds: Path, schema: Path) -> str:
    push = number(answers, "supply_pressure") * piston_area(answers)
    hertz = sizing.natural_frequency(answers, BULK_MODULUS)
    spool, _ = valve(answers).natural_frequency
    written = ", ".join(near(f) for f in (file, eds, schema))
    digits = max(0, 2 - math.floor(math.log10(push * 1e-3)))
    return (
        f"largest push      {push * 1e-3:.{digits}f} kN\n"
        f"no-load speed     {_speed(answers)}\n"
        f"natural frequency {hertz:.3g} Hz of the mass on its oil, spool {spool:.3g} Hz\n"
        f"written           {written}\n"
        f"next              hil-emulator check {near(file)}\n"
        f"                  hil-emulator run {near(file)}"
    )
