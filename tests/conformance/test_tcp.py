"""The suite as a user calls it, against the emulator in another process, over TCP."""

import re
import subprocess
import sys
from pathlib import Path

from suite import inapplicable
from test_end_to_end import NODE, emulator

from hil_emulator.conformance.cases import CASES
from hil_emulator.conformance.plugin import PLUGIN
from hil_emulator.places import shipped

EDS = shipped("eds/hydraulic_actuator.eds")
REMOTE_FRAMES = {"3.3", "3.9", "3.15", "7.2", "7.3", "7.4", "7.6", "7.203", "7.205", "7.207"}
"""Cases made of remote frames, which socketcand's protocol cannot carry."""


def test_the_emulator_conforms_over_tcp(tmp_path: Path) -> None:
    """All cases pass but those about remote frames, which are skipped for that reason."""
    with emulator(tmp_path) as (port, _):
        suite = [sys.executable, "-m", "pytest", "--pyargs", "hil_emulator.conformance"]
        plugins = ["-p", PLUGIN, "-p", "no:cacheprovider"]
        bus = ["--can", "socketcand:can0", "--can-option", "host=127.0.0.1"]
        port_and_device = ["--can-option", f"port={port}", "--node", str(NODE), "--eds", str(EDS)]
        told = subprocess.run(
            [*suite, *plugins, *bus, *port_and_device], capture_output=True, text=True
        )
    report = told.stdout + told.stderr
    total = re.search(r"^all +(\d+) +(\d+) +(\d+) +(\d+)$", report, re.M)
    assert total is not None, report
    skipped = REMOTE_FRAMES | inapplicable(EDS, NODE)
    assert [int(n) for n in total.groups()] == [
        len(CASES),
        len(CASES) - len(skipped),
        0,
        len(skipped),
    ], report
    reasons = re.findall(r"^ *(\S+) .*: skipped: this bus carries no remote frames$", report, re.M)
    assert set(reasons) == REMOTE_FRAMES, report
