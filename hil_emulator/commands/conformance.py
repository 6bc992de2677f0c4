"""`hil-emulator conformance`: run the cases on a device, and report."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.conformance.expectation import Expectation
from hil_emulator.errors import UserError

_PACKAGE = "hil_emulator.conformance"


@dataclass(frozen=True)
class Page:
    """Output of the results as a page.

    Attributes:
        file: the page; no page without it.
        overwrite: whether an existing file is replaced.

    """

    file: Path | None = None
    overwrite: bool = False


def conformance(
    can: str,
    can_options: Sequence[str],
    node: int,
    eds: Path,
    cases: Sequence[str],
    storm: int,
    page: Page,
    *,
    self_starting: bool,
) -> bool:
    """Run the suite; return whether no case failed.

    Raises:
        UserError: pytest is not installed, the EDS cannot be read, or the suite could not
            begin.

    """
    try:
        import pytest
    except ImportError as error:
        raise UserError(
            'the conformance suite needs pytest: pip install "hil-emulator[test]"'
        ) from error
    Expectation(eds, node)  # errors of the EDS are reported before pytest begins
    plugin = f"{_PACKAGE}.plugin"
    options = ["--can", can, "--node", str(node), "--eds", str(eds), "--storm", str(storm)]
    options += [word for option in can_options for word in ("--can-option", option)]
    options += [word for case in cases for word in ("--case", case)]
    options += ["--conformance-html", str(page.file)] if page.file is not None else []
    options += ["--conformance-overwrite"] if page.overwrite else []
    options += ["--self-starting"] if self_starting else []
    quiet = ["-q", "--no-header", "--tb=no", "-rN", "-p", "no:cacheprovider", "-p", "no:warnings"]
    given_up = _GivenUp()
    code = pytest.main(["--pyargs", _PACKAGE, "-p", plugin, *quiet, *options], plugins=[given_up])
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        raise UserError(given_up.reason or "no case was run on the device; see above")
    return code == pytest.ExitCode.OK


class _GivenUp:
    """A pytest plugin that notes why the suite has given up."""

    reason = ""

    def pytest_keyboard_interrupt(self, excinfo: Any) -> None:
        """Note the reason of `pytest.exit`."""
        self.reason = str(getattr(excinfo.value, "msg", ""))
