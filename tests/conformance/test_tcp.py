"""The suite on the command line, with the emulator in another process, over TCP."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from suite import SUITE, inapplicable, total
from test_end_to_end import emulator

from hil_emulator.config.load import load
from hil_emulator.config.nodes import NodeSettings
from hil_emulator.conformance.cases import CASES
from hil_emulator.platform.paths import shipped

COMBINED = shipped("configs/hyq_knee.toml")
SEPARATE = shipped("configs/hyq_knee_separate.toml")
REMOTE_FRAMES = {
    *("3.3", "3.9", "3.15", "3.310", "3.327"),
    *("7.2", "7.3", "7.4", "7.6", "7.203", "7.205", "7.207", "7.305", "7.306"),
    *("3.330", "7.310", "7.311"),
}
"""Cases with remote frames, which the protocol of socketcand cannot carry."""


def check(port: int, node: NodeSettings) -> None:
    """Check that all cases pass except those with remote frames, which are skipped."""
    bus = ["--can", "socketcand:can0", "--can-option", "host=127.0.0.1"]
    rest = ["--can-option", f"port={port}", "--node", str(node.id), "--eds", str(node.eds)]
    process = subprocess.run(
        [sys.executable, "-m", "pytest", *SUITE, *bus, *rest], capture_output=True, text=True
    )
    report = process.stdout + process.stderr
    skipped = len(REMOTE_FRAMES | inapplicable(node.eds, node.id))
    assert total(report) == [len(CASES), len(CASES) - skipped, 0, skipped], report
    reasons = re.findall(r"^ *(\S+) .*: skipped: this bus carries no remote frames$", report, re.M)
    assert set(reasons) == REMOTE_FRAMES, report


@pytest.mark.slow
def test_the_emulator_conforms_over_tcp(tmp_path: Path) -> None:
    """The one node of the combined layout conforms."""
    with emulator(tmp_path) as (port, _):
        check(port, load([COMBINED]).nodes[0])


@pytest.mark.full(sibling="test_the_emulator_conforms_over_tcp")
def test_a_node_of_the_separate_layout_conforms_over_tcp(tmp_path: Path) -> None:
    """The first of four nodes conforms on a common bus; in lock-step each node conforms."""
    with emulator(tmp_path, str(SEPARATE)) as (port, _):
        check(port, load([COMBINED, SEPARATE]).nodes[0])
