"""What to do after an identification, as the first screen of its page lists it."""

from collections.abc import Callable

from hil_emulator.identify.conclusion.result import Result


def next_steps(result: Result) -> list[str]:
    """Return what to do next, most useful first."""
    recommended = [result.next_experiment] if result.next_experiment else []
    return [*_BY_VERDICT[result.verdict](result), *_checks(result), *recommended]


def _checks(result: Result) -> list[str]:
    """Return what to check of the machine: parameters that moved further than tolerances."""
    moved = [p.called(name).replace("_", " ") for name, p in result.parameters.items() if p.moved]
    return [f"Check in data sheets or on the machine: {', '.join(moved)}."] if moved else []


_COMPLETED = (
    "Run the completed model: `hil-emulator run CONFIG identified.toml`.",
    "Test it on a log that was not used here: `hil-emulator gap CONFIG identified.toml new.csv`.",
)


def _missing(result: Result) -> list[str]:
    return list(_COMPLETED)


def _wrong(result: Result) -> list[str]:
    return ["Correct the value in the configuration; identified.toml has it.", *_COMPLETED]


def _unknown(result: Result) -> list[str]:
    table = "Run the model with a table of it: `hil-emulator run CONFIG identified.toml`."
    law = "If you know its law, write it as an effect file and run `identify` again."
    return [*([table] if result.added else []), law]


def _nothing(result: Result) -> list[str]:
    return [
        "Use the configuration as it is.",
        "Test it on a log that was not used here: `hil-emulator gap CONFIG new.csv`.",
    ]


def _undecided(result: Result) -> list[str]:
    if result.next_experiment:
        return []
    return ["Record another log: `hil-emulator experiment` lists experiments that show more."]


def _disagrees(result: Result) -> list[str]:
    return ["Name what is missing: `hil-emulator identify CONFIG log.csv`."]


_BY_VERDICT: dict[str, Callable[[Result], list[str]]] = {
    "missing_effects": _missing, "wrong_value": _wrong, "unknown_effect": _unknown,
    "nothing_missing": _nothing, "agrees": _nothing, "disagrees": _disagrees,
    "cannot_examine": _undecided, "cannot_tell": _undecided,
}  # fmt: skip
