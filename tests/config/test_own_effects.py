"""Effect files of the user's own, from one start of the program to the next."""

import subprocess
import sys
from pathlib import Path

import pytest

DRAG = '''
from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import friction

@effect(friction, knob=Param("strength", "N*s^2/m^2", "drag", 100.0, 0.0, 1e6),
        source="test", signature="force with the square of velocity")
def own_drag(velocity: float, strength: float) -> float:
    """F = F + k v |v|."""
    return strength * velocity * abs(velocity)

EFFECTS = (own_drag,)
'''

RUN = """
from pathlib import Path
import numpy as np
from hil_emulator.config.load import load
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer import Observer
from hil_emulator.identify.prediction.twin import Twin
from hil_emulator.places import shipped
twin = Twin(load([shipped("configs/hyq_knee.toml"), Path("layer.toml")]), Path("kept"))
still = Experiment("still", 1e-3, np.zeros(100), {"position": np.full(100, 0.04)})
observer = Observer(twin, ("position",))
observer.innovations(observer.freeze(still, twin.par, twin.chan), twin.par, twin.chan)
print("predicted")
"""


@pytest.mark.slow
def test_kept_machine_code_finds_them_again(tmp_path: Path) -> None:
    """A second process takes what the first one compiled, even from another folder."""
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "own.py").write_text(DRAG)
        (tmp_path / folder / "layer.toml").write_text('[model]\neffects = ["own.py"]\n')
        (tmp_path / folder / "kept").symlink_to(tmp_path)
        done = subprocess.run([sys.executable, "-c", RUN], cwd=tmp_path / folder,
                              capture_output=True, text=True, timeout=300, check=False)  # fmt: skip
        assert done.stdout == "predicted\n", done.stderr
