"""One compiled model for the whole session."""

from collections.abc import Callable, Mapping

import pytest
from reference_machine import STEP

from hil_emulator.model import kernel
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.plant import Plant
from hil_emulator.platform.paths import cache_folder

USED_BY_TWO = {
    "fixed_pump", "accumulator", "supply_line", "back_pressure", "viscous_friction",
    "coulomb_friction", "load_viscous_friction", "entrained_air", "end_stops", "spool_rate_limit",
    "current_saturation", "rotary_joint", "rod_mass", "coupling_compliance", "driver_lag",
    "transport_delay",
}  # fmt: skip


@pytest.fixture(scope="session")
def model() -> kernel.Kernel:
    """Compile the whole catalogue once; its machine code outlives the session."""
    return kernel.build(cache=cache_folder())


@pytest.fixture(scope="session")
def two_actuators() -> kernel.Kernel:
    """Compile two actuators on one supply, with the effects that their tests use."""
    effects = tuple(e for e in CATALOGUE if e.name in USED_BY_TWO)
    folder = cache_folder()
    return kernel.build(effects, folder, actuators=2)


@pytest.fixture(scope="session")
def make_plant(model: kernel.Kernel) -> Callable[..., Plant]:
    """Build a plant from parameter values."""

    def make(values: Mapping[str, float], step: float = STEP) -> Plant:
        return Plant(model, values, step)

    return make
