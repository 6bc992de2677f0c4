"""A run loads nothing on its way to the bus that only happens to be installed."""

import subprocess
import sys

NEEDLESS = ("pint", "matplotlib", "scipy", "asammdf", "pandas", "cantools")

PROGRAM = f"""
import importlib, sys
from hil_emulator.__main__ import main
arguments = ["run", "hyq_knee", "--bus", "virtual:lean", "--clock=lockstep", "--duration=2 ms"]
main(arguments, standalone_mode=False)
print("needless:", *[name for name in {NEEDLESS} if name in sys.modules])
importlib.import_module("scipy.linalg")
print("at hand:", *[name for name in ("scipy", "scipy.linalg") if name in sys.modules])
"""


def test_a_run_loads_only_what_it_needs() -> None:
    """Packages that python-can and numba look for stay out of a run, and can still be had."""
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    needless, at_hand = run.stdout.splitlines()[-2:]
    assert run.returncode == 0
    assert needless == "needless:"
    assert at_hand == "at hand: scipy scipy.linalg"


EXAMINATION = """
import sys
from hil_emulator.__main__ import main
try:
    main(["gap", "nothing.toml", "nothing.csv"])
except SystemExit:
    pass
needless = ("can", "canopen", "cantools", "asammdf", "pandas", "pyarrow", "matplotlib")
print("needless:", *[name for name in needless if name in sys.modules])
"""


def test_an_examination_loads_nothing_of_the_bus() -> None:
    """Tables need nothing of the bus, nor what its libraries bring to read logs of their own."""
    examined = subprocess.run(
        [sys.executable, "-c", EXAMINATION], capture_output=True, text=True, check=True
    )
    assert examined.stdout.splitlines()[-1] == "needless:"
