"""The reference controller with a valve that has a dead band."""

from pathlib import Path

import pytest

import hil_emulator as hil
from hil_emulator.platform.paths import shipped


@pytest.mark.slow
@pytest.mark.parametrize("lap", ["0.1 mA", "1.5 mA"])
def test_the_reference_controller_crosses_a_dead_band(tmp_path: Path, lap: str) -> None:
    """Out and back it arrives within half a millimetre in a second, and stays there."""
    (tmp_path / "lap.toml").write_text(f'[valve]\noverlap = {{ lap = "{lap}" }}\n')
    (tmp_path / "step.toml").write_text(
        f"""
title = "There and back"
config = ["{shipped("configs/hyq_knee.toml")}", "lap.toml"]
duration = "3 s"
[[step]]
set = {{ position = "50 mm" }}
[[step]]
name = "back"
at = "1.5 s"
set = {{ position = "35 mm" }}
[[expect]]
signal = "model.position"
within = ["49.5 mm", "50.5 mm"]
by = "1 s"
for = "400 ms"
[[expect]]
signal = "model.position"
within = ["34.5 mm", "35.5 mm"]
after = "back"
by = "1 s"
for = "400 ms"
"""
    )
    (outcome,) = hil.play(tmp_path / "step.toml")
    assert [c.passed for c in outcome.checks] == [True, True], outcome.checks
