"""`scenarios.md`: tables and keys of a scenario."""

from build_time.reference import keys
from build_time.reference.markdown import code, page, sentence, table, text
from hil_emulator.model.quantities import INPUTS, SIGNALS
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.schema import Scenario, SignalProfile, Step
from hil_emulator.signals.columns import MODEL, columns
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS

_HEAD = """\
Every table and key of a scenario file (TOML). Times and other quantities are text with a unit, such
as `"200 ms"`. A key without a default may be left out.
[Scenarios](../how_to/scenarios.md) shows how to write and run one."""

_CONDITIONS = """\
A condition compares signals with quantities: `position > 60 mm and load_force < 100 N`. The
comparisons are `>`, `<`, `>=` and `<=`; all that `and` joins have to hold."""


def write() -> str:
    """Return the page."""
    tables = (("The file", Scenario), ("[[step]]", Step), ("[step.profile]", SignalProfile),
              ("[[expect]]", Expect))  # fmt: skip
    sections = [
        f"## {title}\n\n{sentence(model.__doc__ or '')}\n\n{keys.keys(model)}"
        for title, model in tables
    ]
    return page(
        "Scenarios",
        _HEAD,
        *sections,
        "## [step.set]",
        "Settings of the surroundings; of `position`, `load_force` and `valve_current` the one "
        "that is set last is the controller's set point.",
        keys.params(SETTINGS | SET_POINTS),
        "## Signals and conditions",
        _CONDITIONS,
        _signals(),
    )


def _signals() -> str:
    measured = {signal.name: signal.meaning for signal in SIGNALS}
    meanings = {"time": "emulator time"} | {q.name: q.meaning for q in INPUTS}
    meanings |= {c.name: f"sensor: {measured[c.signal]}" for c in CHANNELS}
    meanings |= {f"{MODEL}{name}": meaning for name, meaning in measured.items()}
    rows = [(code(name), text(unit), text(meanings[name])) for name, unit in columns().items()]
    return table(("signal", "unit", "meaning"), rows)
