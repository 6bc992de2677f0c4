from hil_emulator.api.actuator import ActuatorModel as Actuator
from hil_emulator.api.actuator import load as load
from hil_emulator.api.actuator import machines as machines
from hil_emulator.api.identification import Identification as Identification
from hil_emulator.api.identification import gap as gap
from hil_emulator.api.identification import identify as identify
from hil_emulator.api.linear_model import LinearModel as LinearModel
from hil_emulator.api.lockstep import LockstepRig as Rig
from hil_emulator.api.picture import Picture as Picture
from hil_emulator.api.reading import read as read
from hil_emulator.api.scenario import play as play
from hil_emulator.api.tables import to_xarray as to_xarray
from hil_emulator.errors import UserError as UserError

__all__ = [
    "Actuator",
    "Identification",
    "LinearModel",
    "Picture",
    "Rig",
    "UserError",
    "__version__",
    "gap",
    "identify",
    "load",
    "machines",
    "play",
    "read",
    "to_xarray",
]

__version__: str
