"""What the demonstration lets pass."""

import numpy as np
import pytest

from hil_emulator.demo.script import STEPS, STILL, respond
from hil_emulator.signals.columns import MODEL

FORCE = STEPS[-1]
TIME = np.arange(0.0, FORCE.end, 1e-3)


def held(**swing: float) -> dict[str, np.ndarray]:
    """Return a force step that settles at once, with signals that swing at 3.3 Hz by amplitude."""
    wave = np.sin(2 * np.pi * 3.3 * TIME)
    table = {MODEL + n: swing.get(n, 0.0) * wave for n in (*STILL, "load_force")}
    table[MODEL + "load_force"] += FORCE.after
    return {"time": TIME} | table


@pytest.mark.parametrize(
    "swing",
    [{"position": 0.7e-3}, {"pressure_b": 40e5}, {"position": 0.7e-3, "load_force": 35.0}],
    ids=lambda s: " and ".join(s),
)
def test_a_limit_cycle_does_not_pass(swing: dict[str, float]) -> None:
    """Within the tolerance of the force, a rod that hunts is no success."""
    assert respond(FORCE, held()).passed
    assert not respond(FORCE, held(**swing)).passed


def test_a_slow_drift_is_no_limit_cycle() -> None:
    """Oil that leaks past a shut valve moves pressures on a straight line: that passes."""
    table = held()
    table[MODEL + "pressure_a"] = 60e5 + 20e5 * TIME
    assert respond(FORCE, table).passed
