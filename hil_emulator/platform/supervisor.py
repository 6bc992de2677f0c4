"""Supervision of a run's helper processes."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from hil_emulator.platform.helper_process import (
    HelperFailedError,
    HelperProcess,
    RequiredHelperFailedError,
)

_LOOK_S = 0.25  # between two looks at the helpers (assumed)


class Supervisor(AbstractContextManager["Supervisor"]):
    """Watches the helper processes of a run.

    `look` shows their failures to the user. The end of the context raises them, after all helpers
    have been closed.

    Args:
        warn: shows the user a line.

    Attributes:
        failures: messages of all failures so far, oldest first.

    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self.failures: list[str] = []
        self._warn = warn
        self._helpers: list[HelperProcess] = []
        self._required: list[HelperProcess] = []
        self._due = 0.0

    def watch(self, helper: HelperProcess, *, required: bool = False) -> None:
        """Watch a helper from now on.

        Args:
            helper: the process.
            required: whether `look` raises once it has failed.

        """
        self._helpers.append(helper)
        if required:
            self._required.append(helper)

    def look(self) -> None:
        """Look for failures, at most a few times a second however often it is called.

        Raises:
            RequiredHelperFailedError: if a required helper has failed.

        """
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + _LOOK_S
        for failure in self._new():
            self._warn(failure)
        for helper in self._required:
            if helper.failures:
                raise RequiredHelperFailedError(
                    f"the run was ended because it requires {helper.name}"
                )

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Raise the failures, unless an error of another kind ends the run.

        Raises:
            HelperFailedError: if a helper has failed.

        """
        self._new()
        if self.failures and (error is None or isinstance(error, HelperFailedError)):
            if error is None:
                raise HelperFailedError("\n".join(self.failures))
            raise type(error)("\n".join([*self.failures, str(error)])) from None

    def _new(self) -> list[str]:
        """Return the failures since the last look of all helpers."""
        new = [failure for helper in self._helpers for failure in helper.look()]
        self.failures += new
        return new
