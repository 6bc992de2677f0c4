"""Reading of a scenario file: its runs, and messages on its mistakes."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil_emulator.config.load import is_rotary
from hil_emulator.config.mistakes import SHOWN
from hil_emulator.config.table import DescribedTable
from hil_emulator.config.toml_file import read_toml
from hil_emulator.errors import UserError, did_you_mean
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.schema import MOST_RUNS, Scenario, SignalProfile, Step
from hil_emulator.units import axis

_TABLES: dict[str, type[DescribedTable]] = {
    "step": Step,
    "expect": Expect,
    "profile": SignalProfile,
}


def load(file: Path) -> Scenario:
    """Read and check a scenario; of several runs the first.

    Raises:
        UserError: with the place of every mistake.

    """
    return runs_of(file)[0]


def runs_of(file: Path, machine: Sequence[Path] = ()) -> list[Scenario]:
    """Return the runs of a file: each combination of `sweep`, `repeat` times.

    Args:
        file: the scenario.
        machine: files of the configuration, if not those that it names.

    Raises:
        UserError: with the place of every mistake.

    """
    content = read_toml(file, "scenario")
    with axis(rotary=is_rotary(machine or _named(file, content))):
        return _runs(file, content)


def _named(file: Path, content: Mapping[str, Any]) -> list[Path]:
    """Return the configuration files that a scenario names, which is not checked yet."""
    names = content.get("config")
    return [file.parent / str(name) for name in names] if isinstance(names, list) else []


def _runs(file: Path, content: Mapping[str, Any]) -> list[Scenario]:
    texts = repr({key: part for key, part in content.items() if key != "sweep"})
    if unused := [name for name in content.get("sweep", {}) if f"{{{name}}}" not in texts]:
        raise UserError(f"{file}: sweep.{unused[0]}: no text contains {{{unused[0]}}}")
    runs: list[Scenario] = []
    for values in _combinations(file, content.get("sweep", {})):
        scenario = _checked(file, _with_values(content, values))
        if len(runs) + scenario.repeat > MOST_RUNS:
            raise UserError(f"{file}: sweep and repeat make more than {MOST_RUNS} runs")
        runs += [_run(scenario, values, number) for number in range(scenario.repeat)]
    return runs


def _run(scenario: Scenario, values: Mapping[str, str], number: int) -> Scenario:
    """Return one run, with its values in its title."""
    words = [f"{name} {value}" for name, value in values.items()]
    seed = scenario.seed
    if scenario.repeat > 1:
        seed = (1 if seed is None else seed) + number
        words.append(f"seed {seed}")
    title = f"{scenario.title} ({', '.join(words)})" if words else scenario.title
    return scenario.model_copy(update={"title": title, "seed": seed})


def _combinations(file: Path, sweep: object) -> Iterator[dict[str, str]]:
    """Yield the values of each combination; a single one without values if nothing is swept."""
    if not isinstance(sweep, dict) or not all(isinstance(v, list) and v for v in sweep.values()):
        raise UserError(
            f"{file}: sweep: write lists of values by name, such as drop = ['40 bar', '80 bar']"
        )
    for chosen in itertools.islice(itertools.product(*sweep.values()), MOST_RUNS + 1):
        yield dict(zip(sweep, map(str, chosen), strict=True))


def _with_values(content: Any, values: Mapping[str, str]) -> Any:
    """Return the content with each `{name}` in its texts replaced by the value."""
    if isinstance(content, dict):
        return {key: _with_values(part, values) for key, part in content.items()}
    if isinstance(content, list):
        return [_with_values(part, values) for part in content]
    if isinstance(content, str):
        for name, value in values.items():
            content = content.replace(f"{{{name}}}", value)
    return content


def _checked(file: Path, content: Mapping[str, Any]) -> Scenario:
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        mistakes = error.errors()
        lines = [
            f"{file}: {'.'.join(str(part) for part in e['loc']) or 'scenario'}: "
            f"{_mistake(e['loc'], e['type']) or e['msg'].removeprefix('Value error, ')}"
            for e in mistakes[:SHOWN]
        ]
        lines += [f"{file}: and {len(mistakes) - SHOWN} more"] if len(mistakes) > SHOWN else []
        raise UserError("\n".join(lines)) from None


def _mistake(place: Sequence[int | str], kind: str) -> str:
    """Return the message for an unknown key; "" for other mistakes, which pydantic describes."""
    if kind == "missing":
        return "is missing"
    if kind != "extra_forbidden":
        return ""
    tables = [_TABLES[part] for part in map(str, place[:-1]) if part in _TABLES]
    fields = (tables[-1] if tables else Scenario).model_fields
    keys = [field.alias or name for name, field in fields.items()]
    return f"no such key{did_you_mean(str(place[-1]), keys)}"
