"""The whole suite over the virtual bus, in lock-step: without a clock, reproducible."""

from pathlib import Path

import pytest
from constant_node import make_node, stepper
from rigs import bench
from suite import inapplicable, own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load
from hil_emulator.platform.paths import shipped

EDS_FILES = sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))
DEVICES = [
    pytest.param(eds, id=eds.stem, marks=[] if eds.stem == "valve_driver" else pytest.mark.slow)
    for eds in EDS_FILES
]
"""The combined device is also tested on the reference machine."""


@pytest.mark.parametrize("eds", DEVICES)
@pytest.mark.parametrize("node_id", [1, pytest.param(127, marks=pytest.mark.slow)])
def test_every_shipped_device_conforms(eds: Path, node_id: int) -> None:
    """Each device with a shipped EDS passes all cases, with node-ID 1 and 127."""
    settings = own_channel()
    with Bus(settings) as port, Bus(settings) as peer:
        results = run_in_lock_step(peer, stepper(make_node(eds, node_id), port), node_id, eds)
    results.check(skipped=inapplicable(eds, node_id))


@pytest.mark.slow
@pytest.mark.parametrize(
    "files",
    [pytest.param(["configs/hyq_knee.toml"], id="combined"),
     pytest.param(["configs/hyq_knee.toml", "configs/hyq_knee_separate.toml"],
                  id="separate",
                  marks=pytest.mark.full(sibling="test_the_emulator_conforms"))],
)  # fmt: skip
def test_the_emulator_conforms(files: list[str]) -> None:
    """On the reference machine, with hydraulics and noise, all nodes of a layout conform."""
    config = load([shipped(name) for name in files])
    with bench(config) as emulator:
        for node in config.nodes:
            results = run_in_lock_step(emulator.peer, emulator.rig.step, node.id, node.eds)
            results.check(skipped=inapplicable(node.eds, node.id))
