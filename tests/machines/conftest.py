"""What tests of machines share."""

import pytest

from hil_emulator.model import kernel
from hil_emulator.model.kernel import Kernel
from hil_emulator.platform.paths import cache_folder


@pytest.fixture(scope="session")
def model() -> Kernel:
    """Return the compiled catalogue; its machine code outlives the session."""
    return kernel.build(cache=cache_folder())
