"""How a run notices that a helper process has failed, and what its message contains."""

import os
import signal
import time
from collections.abc import Callable, Iterator

import pytest

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import (
    HelperFailedError,
    HelperProcess,
    ending,
)
from hil_emulator.platform.supervisor import Supervisor

PATIENCE_S = 30.0  # a failing test ends after this; a passing one never waits for it
LOSS = "nothing is counted any more; count by hand"


@pytest.fixture
def counter() -> Iterator[HelperProcess]:
    """Yield a helper that reports what it is given, and ends when its input does."""
    helper = HelperProcess(["cat"], "counter", LOSS)
    yield helper
    helper.close()


def failures(helper: HelperProcess) -> list[str]:
    """Return the failures that come next."""
    deadline = time.monotonic() + PATIENCE_S
    while not (failed := helper.look()):
        assert time.monotonic() < deadline, "no failure came"
        time.sleep(0.002)
    return failed


def test_a_helper_that_is_killed_is_one_failure(counter: HelperProcess) -> None:
    """The message has its name, the signal, the loss and the way out; it comes once."""
    assert counter.look() == []
    os.kill(counter.pid, signal.SIGKILL)
    words = f"counter: its process was ended by signal 9 (SIGKILL); {LOSS}"
    assert failures(counter) == [words]
    assert counter.look() == []
    counter.close()
    assert counter.failures == [words]


def test_a_helper_reports_what_fails_while_it_works(counter: HelperProcess) -> None:
    """Each whole line is a failure; part of a line is not one yet."""
    counter.write(b"the first finger is lost\nthe sec")
    assert failures(counter) == ["the first finger is lost"]
    counter.write(b"ond one, too\n")
    assert failures(counter) == ["the second one, too"]
    assert len(counter.failures) == 2


def test_a_helper_that_is_closed_has_not_failed(counter: HelperProcess) -> None:
    """Its end was wanted."""
    counter.close()
    assert counter.failures == []


@pytest.mark.parametrize(
    ("script", "failed"),
    [
        ("read x; exit 3", [f"counter: its process ended by itself with exit code 3; {LOSS}"]),
        ("read x; echo no paper; exit 3", ["no paper"]),
        ("read x; echo no paper", ["no paper"]),
    ],
)
def test_failures_at_the_end_of_a_helper_count(script: str, failed: list[str]) -> None:
    """One that ends badly when it is closed has failed, for the reason that it gives."""
    helper = HelperProcess(["sh", "-c", script], "counter", LOSS)
    helper.close()
    assert helper.failures == failed


def test_a_helper_that_ends_early_with_exit_code_0_has_failed() -> None:
    """Only the end of a helper that was closed is in order."""
    helper = HelperProcess(["true"], "counter", LOSS)
    assert "ended by itself with exit code 0" in failures(helper)[0]
    helper.close()


def supervised(
    helper: HelperProcess, act: Callable[[Supervisor], None], *, required: bool = False
) -> list[str]:
    """Do something as a run does that a helper works for; return its warnings."""
    warnings: list[str] = []
    with Supervisor(warnings.append) as supervisor:
        supervisor.watch(helper, required=required)
        act(supervisor)
    return warnings


def test_the_run_goes_on_and_says_at_its_end_what_has_failed(counter: HelperProcess) -> None:
    """A warning comes at once, an error with exit code 3 at the end."""

    def act(supervisor: Supervisor) -> None:
        os.kill(counter.pid, signal.SIGTERM)
        os.waitid(os.P_PID, counter.pid, os.WEXITED | os.WNOWAIT)
        supervisor.look()
        assert "SIGTERM" in supervisor.failures[0]

    with pytest.raises(HelperFailedError, match="SIGTERM") as raised:
        supervised(counter, act)
    assert raised.value.exit_code == 3


def test_a_run_whose_helpers_do_well_ends_well(counter: HelperProcess) -> None:
    """There is no warning and no error."""
    assert supervised(counter, lambda supervisor: supervisor.look()) == []


def test_the_run_ends_with_a_helper_that_it_requires(counter: HelperProcess) -> None:
    """The next look raises; failures until the end of the run are in the error, too."""

    def act(supervisor: Supervisor) -> None:
        counter.write(b"no paper\n")
        deadline = time.monotonic() + PATIENCE_S
        try:
            while time.monotonic() < deadline:
                supervisor.look()
                time.sleep(0.002)
        finally:
            counter.write(b"no ink\n")
            counter.close()

    with pytest.raises(HelperFailedError, match=r"^no paper\nno ink\n.* requires counter$"):
        supervised(counter, act, required=True)


def test_what_ends_a_run_is_not_hidden_by_what_has_failed_before(counter: HelperProcess) -> None:
    """An error of another kind passes unchanged."""

    def act(supervisor: Supervisor) -> None:
        counter.write(b"no paper\n")
        failures(counter)
        raise UserError("the plant has failed")

    with pytest.raises(UserError, match="the plant has failed"):
        supervised(counter, act)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (1, "ended by itself with exit code 1"),
        (-11, "was ended by signal 11 (SIGSEGV)"),
        (-63, "was ended by signal 63"),
    ],
)
def test_an_end_has_words(code: int, words: str) -> None:
    """A signal has its number, and its name if it has one; an exit code has its number."""
    assert ending(code) == words
