"""Running the conformance suite from a test, with its results."""

import itertools
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.conformance.cases import CASES
from hil_emulator.conformance.expectation import Expectation
from hil_emulator.conformance.patterns import loops
from hil_emulator.conformance.plugin import PLUGIN, label
from hil_emulator.conformance.wire import SteppedTime, Wire

SUITE = ("--pyargs", "hil_emulator.conformance", "-p", PLUGIN, "-p", "no:cacheprovider")
"""Arguments for pytest."""
_numbers = itertools.count()


def own_channel() -> dict[str, object]:
    """Return the settings of a separate virtual bus."""
    return {"interface": "virtual", "channel": f"conformance {next(_numbers)}"}


def total(report: str) -> list[int]:
    """Return the last line of a report's table: cases, passed, failed, skipped."""
    totals = re.search(r"^all +(\d+) +(\d+) +(\d+) +(\d+)$", report, re.M)
    assert totals is not None, report
    return [int(number) for number in totals.groups()]


def inapplicable(eds: Path, node_id: int) -> set[str]:
    """Return the cases about optional services that a device of this EDS lacks."""
    expectation = Expectation(eds, node_id)
    cases = set()
    if not expectation.indices(range(0x1400, 0x1600)):
        cases |= {"3.27", "3.28", "3.29", "3.33"}  # RPDOs: a sensor takes no process data
    if not [v for v in expectation.variables.values() if v.receivable and v.readable]:
        cases |= {f"3.{number}" for number in range(303, 310)}  # values that come by RPDO
    if not any(len(expectation.default(v) or b"") > 14 for v in expectation.variables.values()):
        cases |= {"2.312"}  # a string of three segments
    if not loops(expectation):
        cases |= {"3.302", "3.310", "3.311"}  # an object that SDO writes and a TPDO shows
    if not expectation.find({"rww", "wo"}, mappable=True):
        cases |= {"3.31"}  # a process output to be refused in a TPDO
    return cases


class Results:
    """A pytest plugin: connects the suite to a device in this process, and collects outcomes.

    Args:
        peer: the suite's port on the virtual bus.
        step: executes one tick of the device.
        only: the cases to run.

    """

    def __init__(self, peer: Bus, step: Callable[[], None], only: set[str]) -> None:
        self._only = only
        self.wire = Wire(peer, SteppedTime(step))
        self.outcomes: dict[str, str] = {}
        self.remarks: list[str] = []
        self.runs = 0
        self._labels: dict[str, str] = {}

    def check(self, skipped: set[str]) -> None:
        """Check that all cases passed except the skipped ones."""
        wanted = {name: "skipped" if name in skipped else "passed" for name in CASES}
        assert self.outcomes == wanted, "\n".join(self.remarks)

    def pytest_conformance_wire(self) -> Wire:
        """Return the wire to the device."""
        return self.wire

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Deselect all cases but `only`."""
        items[:] = [item for item in items if label(item) in self._only]

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Store the case of each test."""
        self._labels = {item.nodeid: str(label(item)) for item in session.items}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Store an outcome."""
        name = self._labels[report.nodeid]
        if report.when == "call" or report.outcome != "passed":
            self.outcomes[name] = report.outcome
            self.runs += 1
            if report.outcome != "passed":
                self.remarks.append(f"{name} {report.outcome}: {report.longrepr}")


def run_in_lock_step(
    peer: Bus,
    step: Callable[[], None],
    node_id: int,
    eds: Path,
    only: set[str] | None = None,
    *,
    first: bool = False,
    more: Sequence[str] = (),
) -> Results:
    """Run the suite on a device whose time advances only while the suite waits.

    Args:
        peer: the suite's port on the virtual bus.
        step: executes one tick of the device.
        node_id: of the device.
        eds: of the device.
        only: the cases to run; None for all.
        first: whether to stop at the first failing case.
        more: other options for pytest.

    """
    results = Results(peer, step, only or set(CASES))
    where = ["--node", str(node_id), "--eds", str(eds)]
    options = ["-q", "--no-header", *(["-x"] if first else []), *more]
    pytest.main([*SUITE, *where, *options], plugins=[results])
    return results
