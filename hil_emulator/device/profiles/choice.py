"""Which profile a node has."""

from collections.abc import Sequence

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.profiles.analogue_input import FIELD_VALUE
from hil_emulator.device.profiles.encoder import POSITION, Encoder
from hil_emulator.device.profiles.measuring_device import MeasuringDevice
from hil_emulator.device.profiles.profile import NoProfile, Profile
from hil_emulator.device.profiles.valve import SET_POINT, ValveDriver

DEVICE_TYPE = 0x1000
PROFILE_NUMBER = 0xFFFF
"""The low word of 0x1000 (CiA 301 7.5.2.1)."""


def profile_of(dictionary: Dictionary, channels: Sequence[str], emergency: Emergency) -> Profile:
    """Return the profile the dictionary claims and has the objects of.

    Args:
        dictionary: the node's dictionary.
        channels: names of the sensor channels, in the order of `Measured`.
        emergency: told of the profile's own errors.

    """
    number = int(dictionary.entry(DEVICE_TYPE).value) & PROFILE_NUMBER
    if number == 404 and FIELD_VALUE in dictionary:
        return MeasuringDevice(dictionary, channels)
    if number == 406 and POSITION in dictionary:
        return Encoder(dictionary, channels)
    if number == 408 and SET_POINT in dictionary:
        return ValveDriver(dictionary, channels, emergency)
    return NoProfile()
