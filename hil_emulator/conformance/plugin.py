"""The suite's options on pytest's command line, the order of its cases, and its report."""

import re
from pathlib import Path
from typing import Any

import pytest

from hil_emulator.conformance.cases import CASES, MARK
from hil_emulator.conformance.report import Judgement, page, remarks, table
from hil_emulator.conformance.sdo_client import Aborted
from hil_emulator.conformance.wire import Wire
from hil_emulator.errors import UserError
from hil_emulator.platform.output_files import refuse_existing, write_texts

PLUGIN = __name__
"""Name of the plugin for `pytest -p`."""

CALM, STORMY = "calm", "after the storm"
"""The two rounds of cases with `--storm`: before and after its random frames."""

ABOUT = pytest.StashKey[list[tuple[str, str]]]()
"""Identity of the device, for the page."""

_ABORTED = f"{Aborted.__module__}.{Aborted.__name__}: "
_ABORT_CODE = re.compile(r"\b[1-9]\d{7,8}\b")
"""Abort codes in decimal, as assertions show them; in hexadecimal they begin with 0."""
_WAY_OUT = "choose another name, or add --conformance-overwrite to replace it"
_PROPERTY = "conformance case"
_ROUND = "conformance round"


class Hooks:
    """Hooks that another plugin may implement."""

    @pytest.hookspec(firstresult=True)
    def pytest_conformance_wire(self, config: pytest.Config) -> Wire | None:
        """Return a wire to the device, in place of the one that `--can` describes."""


def pytest_addhooks(pluginmanager: pytest.PytestPluginManager) -> None:
    """Offer the hooks."""
    pluginmanager.add_hookspecs(Hooks)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for bus, device and report."""
    group = parser.getgroup("conformance", "CANopen conformance (hil_emulator.conformance)")
    group.addoption(
        "--can", metavar="INTERFACE:CHANNEL", help="python-can bus, such as socketcan:can0"
    )
    group.addoption(
        "--can-option",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="an argument of python-can's Bus, such as host=127.0.0.1; may be repeated",
    )
    group.addoption("--node", metavar="ID", type=int, help="node-ID of the device, 1 to 127")
    group.addoption("--eds", metavar="FILE", type=Path, help="EDS or DCF of the device")
    group.addoption(
        "--case", metavar="LABEL", action="append", default=[], dest="conformance_cases",
        help="a case or a chapter, such as 2.7 or 3 (default: all); may be repeated",
    )  # fmt: skip
    group.addoption(
        "--self-starting", action="store_true",
        help="accept that the device enters OPERATIONAL by itself without 0x1F80",
    )  # fmt: skip
    group.addoption(
        "--storm", metavar="N", type=int, default=0,
        help="after all cases send N random frames to the device, then repeat all cases",
    )  # fmt: skip
    group.addoption(
        "--conformance-html", metavar="FILE", type=Path, help="write the report as an HTML page"
    )
    group.addoption(
        "--conformance-overwrite", action="store_true", help="replace a report that exists"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark of the cases; refuse a report that exists."""
    html = config.getoption("--conformance-html")
    if html is not None:
        overwrite = config.getoption("--conformance-overwrite")
        try:
            refuse_existing([html], overwrite=overwrite, way_out=_WAY_OUT)
        except UserError as error:
            raise pytest.UsageError(str(error)) from None
    config.addinivalue_line("markers", f"{MARK}(label): a conformance case, such as 2.7")
    config.stash[ABOUT] = []
    config.pluginmanager.register(FailureLines(config))


def label(item: pytest.Item) -> str | None:
    """Return the label of a test's case, None for other tests."""
    mark = item.get_closest_marker(MARK)
    return None if mark is None else str(mark.args[0])


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat each case in a second round with `--storm`."""
    if metafunc.config.getoption("--storm") and metafunc.definition.get_closest_marker(MARK):
        metafunc.parametrize("weather", [CALM, STORMY], indirect=True)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Sort the cases by number, and add case and round to the test reports."""
    wanted = config.getoption("conformance_cases")
    if wanted:
        items[:] = [item for item in items if _wanted(label(item), wanted)]
    for item in items:
        case = label(item)
        if case is not None:
            item.user_properties += [(_PROPERTY, case), (_ROUND, _round(item))]
    order = {name: position for position, name in enumerate(CASES)}
    if items and all(label(item) in order for item in items):
        items.sort(key=lambda item: (_round(item) != CALM, order[str(label(item))]))


def _wanted(name: str | None, wanted: list[str]) -> bool:
    return name is not None and any(name == w or name.startswith(f"{w}.") for w in wanted)


def _round(item: pytest.Item) -> str:
    call = getattr(item, "callspec", None)
    return CALM if call is None else str(call.params.get("weather", CALM))


def announce(config: pytest.Config, line: str) -> None:
    """Print a line among the progress of the cases."""
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    reporter.line("")
    reporter.line(line)


class FailureLines:
    """Prints the reason of a failure when the case ends, so that an aborted run shows it, too.

    Args:
        config: holds the terminal.

    """

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Print the line of a failed case."""
        name = dict(report.user_properties).get(_PROPERTY)
        if report.failed and name in CASES:
            judgement = {str(name): Judgement("failed", _reason(report))}
            announce(self._config, next(remarks(judgement)))


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Print the outcomes by chapter, and the reason of each skipped or failed case."""
    judgements = _judgements(terminalreporter)
    if not judgements:
        return
    terminalreporter.section("CANopen conformance")
    for line in (*table(judgements), *remarks(judgements)):
        terminalreporter.line(line)
    path, about = config.getoption("--conformance-html"), config.stash[ABOUT]
    if path is not None:
        overwrite = config.getoption("--conformance-overwrite")
        try:
            write_texts({path: page(judgements, about)}, overwrite=overwrite)
        except UserError as error:
            terminalreporter.line(str(error))


def _judgements(terminalreporter: pytest.TerminalReporter) -> dict[str, Judgement]:
    """Return the outcomes of the cases; a failure in either of two rounds counts."""
    judgements: dict[str, Judgement] = {}
    for outcome in ("passed", "skipped", "failed", "error"):
        for report in terminalreporter.stats.get(outcome, ()):
            properties = dict(getattr(report, "user_properties", ()))
            name, weather = properties.get(_PROPERTY), properties.get(_ROUND, CALM)
            worse = outcome in ("failed", "error")
            if name is None or (worse and judgements.get(name, Judgement("")).outcome == "failed"):
                continue
            reason = "" if outcome == "passed" else _reason(report)
            if worse and weather != CALM:
                reason = f"{weather}: {reason}"
            judgements[name] = Judgement("failed" if worse else outcome, reason)
    return judgements


def _reason(report: pytest.TestReport) -> str:
    """Return the reason in one line."""
    where = report.longrepr
    if isinstance(where, tuple):
        return str(where[2]).removeprefix("Skipped: ")
    crash = getattr(where, "reprcrash", None)
    text = str(where if crash is None else crash.message).partition("\n")[0]
    text = text.removeprefix("AssertionError: ").replace(_ABORTED, "")
    return _ABORT_CODE.sub(lambda code: f"{int(code[0]):08X}", text)
