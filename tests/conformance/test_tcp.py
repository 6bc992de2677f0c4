"""The suite as a user calls it, against the emulator in another process, over TCP."""

import re
import subprocess
import sys
from pathlib import Path

from suite import SUITE, inapplicable, total
from test_end_to_end import NODE, emulator

from hil_emulator.conformance.cases import CASES
from hil_emulator.places import shipped

EDS = shipped("eds/hydraulic_actuator.eds")
REMOTE_FRAMES = {"3.3", "3.9", "3.15", "7.2", "7.3", "7.4", "7.6", "7.203", "7.205", "7.207"}
"""Cases made of remote frames, which socketcand's protocol cannot carry."""


def test_the_emulator_conforms_over_tcp(tmp_path: Path) -> None:
    """All cases pass but those about remote frames, which are skipped for that reason."""
    with emulator(tmp_path) as (port, _):
        bus = ["--can", "socketcand:can0", "--can-option", "host=127.0.0.1"]
        rest = ["--can-option", f"port={port}", "--node", str(NODE), "--eds", str(EDS)]
        told = subprocess.run(
            [sys.executable, "-m", "pytest", *SUITE, *bus, *rest], capture_output=True, text=True
        )
    report = told.stdout + told.stderr
    skipped = len(REMOTE_FRAMES | inapplicable(EDS, NODE))
    assert total(report) == [len(CASES), len(CASES) - skipped, 0, skipped], report
    reasons = re.findall(r"^ *(\S+) .*: skipped: this bus carries no remote frames$", report, re.M)
    assert set(reasons) == REMOTE_FRAMES, report
