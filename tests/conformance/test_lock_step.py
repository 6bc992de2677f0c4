"""The whole suite over the virtual bus, in lock-step: no clock, no waiting, every run the same."""

from pathlib import Path

import pytest
from constant_node import make_node, stepper
from rigs import bench, reference
from suite import inapplicable, own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus
from hil_emulator.places import shipped

EDS_FILES = sorted(shipped("eds/hydraulic_actuator.eds").parent.glob("*.eds"))


@pytest.mark.parametrize("eds", EDS_FILES, ids=lambda path: path.stem)
@pytest.mark.parametrize("node_id", [1, 127])
def test_every_shipped_device_conforms(eds: Path, node_id: int) -> None:
    """Each device whose EDS is shipped passes all cases, at either end of the node-IDs."""
    settings = own_channel()
    with Bus(settings) as own, Bus(settings) as peer:
        results = run_in_lock_step(peer, stepper(make_node(eds, node_id), own), node_id, eds)
    results.check(skipped=inapplicable(eds, node_id))


def test_the_emulator_conforms() -> None:
    """The reference machine, hydraulics and noise included, passes all cases."""
    with bench(reference()) as emulator:
        node = reference().nodes[0]
        results = run_in_lock_step(emulator.peer, emulator.rig.step, node.id, node.eds)
    results.check(skipped=inapplicable(node.eds, node.id))
