"""The processes that a process has started."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

import pytest

PATIENCE_S = 60.0  # a failing test ends after this; a passing one never waits for it


def children(number: int) -> dict[int, str]:
    """Return the command lines of the processes that each thread of a process has started."""
    commands = {}
    for file in Path(f"/proc/{number}/task").glob("*/children"):
        for child in map(int, file.read_text().split()):
            commands[child] = Path(f"/proc/{child}/cmdline").read_text()
    return commands


def descendants(number: int) -> dict[int, str]:
    """Return the command lines of those processes, and of all that they have started."""
    all_of_them = {}
    for child_number, command in children(number).items():
        all_of_them |= {child_number: command, **descendants(child_number)}
    return all_of_them


def child(number: int, program: str) -> int:
    """Return the number of the process of a program, once there is one."""
    if not Path(f"/proc/{number}/task/{number}/children").exists():
        pytest.skip("this system does not list the children of a process")
    return until(lambda: next((n for n, line in children(number).items() if program in line), 0))


def until(condition: Callable[[], int]) -> int:
    """Wait for something that is not 0, and return it."""
    deadline = monotonic() + PATIENCE_S
    while not (value := condition()):
        assert monotonic() < deadline, "it never came"
        sleep(0.01)
    return value
