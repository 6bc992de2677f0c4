"""One compiled model for the whole session."""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from reference_machine import STEP

from hil_emulator.model import kernel
from hil_emulator.model.plant import Plant


@pytest.fixture(scope="session")
def model() -> kernel.Kernel:
    """Compile the whole catalogue once; its machine code outlives the session."""
    return kernel.build(cache=Path(tempfile.gettempdir()) / "hil_emulator_test_kernels")


@pytest.fixture(scope="session")
def make_plant(model: kernel.Kernel) -> Callable[..., Plant]:
    """Build a plant from parameter values."""

    def make(values: Mapping[str, float], step: float = STEP) -> Plant:
        return Plant(model, values, step)

    return make
