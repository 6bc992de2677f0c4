"""The controller under test on the emulator's bus."""

import hashlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from broken_controllers import make
from controller import Controller


@pytest.fixture
def controller(emulator: Any, can_bus: Any, request: pytest.FixtureRequest) -> Iterator[Controller]:
    """Yield the controller, which acts once per tick; EXAMPLE_CONTROLLER chooses a broken one."""
    made = make(os.environ.get("EXAMPLE_CONTROLLER", "sound"), can_bus, emulator.config.nodes[0].id)
    emulator.every_tick(made.step)
    yield made
    if log := os.environ.get("EXAMPLE_DIGESTS"):
        digest = hashlib.sha256(repr(emulator.recorder.frames).encode()).hexdigest()
        with Path(log).open("a") as out:
            out.write(f"{request.node.name} {digest}\n")


@pytest.fixture
def holding(controller: Controller, run_for: Any) -> Controller:
    """Return the controller when it has held 40 mm for 150 ms."""
    run_for("150 ms")
    return controller
