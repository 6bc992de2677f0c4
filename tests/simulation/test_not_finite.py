"""A model whose state is not finite is reported on the bus, and the run ends or restarts."""

import dataclasses
import math
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rigs import NODE, START, Bench, bench, reference

from hil_emulator.config.load import load
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal
from hil_emulator.simulation.not_finite import NotFiniteError

EMERGENCY = Frame(0x080 + NODE, bytes.fromhex("0061010000000000"))
"""Code 0x6100, internal software; error register: generic (CiA 301 7.2.7.1)."""
NO_ERROR = Frame(0x080 + NODE, bytes(8))
KNEE = shipped("configs/hyq_knee.toml")


def position(frames: list[Frame]) -> int:
    """Return the raw position of TPDO2."""
    (frame,) = (f for f in frames if f.can_id == 0x280 + NODE)
    return int(struct.unpack_from("<i", frame.data)[0])


def failing(b: Bench) -> list[Frame]:
    """Set the rod's velocity to NaN; return the frames that the peer received in that tick."""
    b.ticks(10, START)
    b.rig.plant.state.velocity = math.nan
    with pytest.raises(NotFiniteError, match=r"at 0\.010 s the model's pressure_a is not finite"):
        b.tick()
    return b.peer.receive()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_every_state_is_checked(value: float) -> None:
    """Each state with each non-finite value is detected; the largest finite number is accepted."""
    with bench(reference()) as b:
        plant = b.rig.plant
        for i, name in enumerate(plant.kernel.state.names or ()):
            sound = plant.state_vector[i]
            plant.state_vector[i] = sys.float_info.max
            assert plant.step(0)
            plant.state_vector[i] = value
            assert not plant.step(0)
            assert plant.culprit() == name
            plant.state_vector[i] = sound
        assert plant.step(1)
        assert plant.culprit() == ""


def test_bus_and_recording_report_it_before_the_run_ends() -> None:
    """An emergency is sent, and the PDO has the lowest value of its type."""
    with bench(reference()) as b:
        frames = failing(b)
        assert EMERGENCY in frames
        assert position(frames) == -(2**31)
        rows = b.recorder.rows()
        assert len(rows) == 11
        assert np.isfinite(rows[-2]).all()
        assert np.isnan(b.recorder.table()["position"][-1])


def test_separate_instruments_report_invalid_values() -> None:
    """CiA 404 status "not valid", CiA 406 alarm "position error", and an emergency each."""
    config = load([KNEE, shipped("configs/hyq_knee_separate.toml")])
    with bench(config) as b:
        frames = failing(b)
        nodes = {node.node_id: node for node in b.rig.nodes}
        for node_id in nodes:
            assert Frame(0x080 + node_id, EMERGENCY.data) in frames
        statuses = [d.get(0x6150, 1) for d in (n.dictionary for n in nodes.values())]
        assert [s.value for s in statuses if s is not None] == [1, 1]
        alarms = [d.get(0x6503) for d in (n.dictionary for n in nodes.values())]
        assert [a.value for a in alarms if a is not None] == [1]


def test_a_model_that_is_reset_restarts_at_rest() -> None:
    """The emergency ends, the readings are those of the start, and time continues."""
    config = dataclasses.replace(reference(), not_finite="reset")
    with bench(config) as b:
        b.ticks(10, START)
        begin = position(b.tick())
        b.rig.plant.state.velocity = math.inf
        assert EMERGENCY in b.tick()
        after = b.ticks(20)
        assert NO_ERROR in after
        assert EMERGENCY not in after
        assert position(after[-4:]) == pytest.approx(begin, abs=1000)  # 0.1 mm
        assert b.rig.now_ns == 32_000_000
        assert np.isfinite(b.recorder.rows()[-1]).all()


def test_the_command_ends_with_what_has_happened(tmp_path: Path) -> None:
    """With a step that is too long: exit code 1, tick and state, and a complete recording."""
    stiff = tmp_path / "stiff.toml"
    stiff.write_text(
        '[rig]\nstep = "1 ms"\n[load]\nmass = "0.1 kg"\n'
        '[friction]\nviscous_friction = "1e5 N*s/m"\n'
    )
    command = [sys.executable, "-m", "hil_emulator", "run", KNEE, stiff, "--clock", "lockstep"]
    options = ["--duration", "1 s", "--bus", "virtual:stiff", "--record", tmp_path / "run.rec"]
    result = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert result.returncode == 1, result.stderr
    assert "at 0.000 s the model's pressure_a is not finite any more" in result.stderr
    assert "Traceback" not in result.stderr
    recording = journal.read(tmp_path / "run.rec")
    assert len(recording.rows) == 1
    assert np.isnan(recording.table()["position"][-1])
