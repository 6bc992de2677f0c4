"""The suite's options on pytest's command line, and its report: a table per chapter."""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from hil_emulator.conformance.cases import CASES, CHAPTERS, MARK
from hil_emulator.conformance.wire import Wire

PLUGIN = __name__
"""What `pytest -p` calls it."""

OUTCOMES = ("passed", "failed", "skipped")
_PROPERTY = "conformance case"


class Hooks:
    """What another plugin may take over."""

    @pytest.hookspec(firstresult=True)
    def pytest_conformance_wire(self, config: pytest.Config) -> Wire | None:
        """Return a wire to the device, in place of the one that `--can` describes."""


def pytest_addhooks(pluginmanager: pytest.PytestPluginManager) -> None:
    """Offer the hooks."""
    pluginmanager.add_hookspecs(Hooks)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add where the device is and what it promises."""
    group = parser.getgroup("conformance", "CANopen conformance (hil_emulator.conformance)")
    group.addoption(
        "--can", metavar="INTERFACE:CHANNEL", help="python-can bus, such as socketcan:can0"
    )
    group.addoption(
        "--can-option",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="another argument of python-can's Bus, such as host=127.0.0.1; may be repeated",
    )
    group.addoption("--node", metavar="ID", type=int, help="node-ID of the device, 1 to 127")
    group.addoption("--eds", metavar="FILE", type=Path, help="EDS or DCF of the device")


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark of the cases."""
    config.addinivalue_line("markers", f"{MARK}(label): a conformance case, such as 2.7")


def label(item: pytest.Item) -> str | None:
    """Return which case a test is, None for other tests."""
    mark = item.get_closest_marker(MARK)
    return None if mark is None else str(mark.args[0])


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring the cases into the order of their numbers, and let reports carry these."""
    for item in items:
        found = label(item)
        if found is not None:
            item.user_properties.append((_PROPERTY, found))
    order = {name: position for position, name in enumerate(CASES)}
    if items and all(label(item) in order for item in items):
        items.sort(key=lambda item: order[str(label(item))])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what came of the cases, chapter by chapter, and why some were skipped or failed."""
    outcomes: dict[str, str] = {}
    reasons: dict[str, str] = {}
    for outcome in (*OUTCOMES, "error"):
        for report in terminalreporter.stats.get(outcome, ()):
            for name, value in getattr(report, "user_properties", ()):
                if name == _PROPERTY:
                    outcomes[value] = "failed" if outcome == "error" else outcome
                    reasons[value] = _reason(report)
    if outcomes:
        terminalreporter.section("CANopen conformance")
        for line in table(outcomes):
            terminalreporter.line(line)
        for line in _remarks(outcomes, reasons):
            terminalreporter.line(line)


def table(outcomes: dict[str, str]) -> Iterator[str]:
    """Yield a table of how many cases of each chapter had which outcome."""
    yield f"{'chapter':<26}{'cases':>8}" + "".join(f"{o:>9}" for o in OUTCOMES)
    total: Counter[str] = Counter()
    for number, title in CHAPTERS.items():
        labels = [name for name, case in CASES.items() if case.chapter == number]
        counted = Counter(outcomes[name] for name in labels if name in outcomes)
        total += counted
        yield _row(f"{number:>2}  {title}", len(labels), counted)
    yield _row("all", len(CASES), total)


def _row(title: str, cases: int, counted: Counter[str]) -> str:
    return f"{title:<26}{cases:>8}" + "".join(f"{counted[o]:>9}" for o in OUTCOMES)


def _remarks(outcomes: dict[str, str], reasons: dict[str, str]) -> Iterable[str]:
    for name, case in CASES.items():
        if outcomes.get(name) in ("failed", "skipped"):
            yield f"{name:>6} {case.subject}: {case.name}: {outcomes[name]}: {reasons[name]}"


def _reason(report: pytest.TestReport) -> str:
    """Return the one line that says why."""
    where = report.longrepr
    if isinstance(where, tuple):
        return str(where[2]).removeprefix("Skipped: ")
    crash = getattr(where, "reprcrash", None)
    return str(where if crash is None else crash.message).partition("\n")[0]
