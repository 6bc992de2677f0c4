"""What tests of machines share."""

import tempfile
from pathlib import Path

import pytest

from hil_emulator.model import kernel
from hil_emulator.model.kernel import Kernel


@pytest.fixture(scope="session")
def model() -> Kernel:
    """Return the compiled catalogue; its machine code outlives the session."""
    return kernel.build(cache=Path(tempfile.gettempdir()) / "hil_emulator_test_kernels")
