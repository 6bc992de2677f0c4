"""Selection of a node's profile."""

from collections.abc import Sequence

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency
from hil_emulator.device.profiles import amplifier, drive, measuring_device, valve
from hil_emulator.device.profiles.amplifier import Amplifier
from hil_emulator.device.profiles.drive import Drive
from hil_emulator.device.profiles.encoder import MULTI_POSITION, POSITION, Encoder
from hil_emulator.device.profiles.measuring_device import MeasuringDevice
from hil_emulator.device.profiles.profile import NoProfile, Profile
from hil_emulator.device.profiles.valve import ValveDriver

DEVICE_TYPE = 0x1000
PROFILE_NUMBER = 0xFFFF
"""The low word of 0x1000 (CiA 301 7.5.2.1)."""
ROTARY = range(1, 6)
"""High word of 0x1000: encoders of angles; there is no channel of an angle (CiA 406)."""


def profile_of(dictionary: Dictionary, channels: Sequence[str], emergency: Emergency) -> Profile:
    """Return the profile that 0x1000 names and whose objects exist.

    A profile does not change objects whose scale is set in the configuration.

    Args:
        dictionary: the node's dictionary.
        channels: names of the sensor channels, in the order of `Measured`.
        emergency: reports errors of the profile.

    """
    device_type = int(dictionary.entry(DEVICE_TYPE).value)
    number, kind = device_type & PROFILE_NUMBER, device_type >> 16
    if number == 404:
        direct = measuring_device.shown_directly(dictionary, channels)
        if not direct and measuring_device.complete(dictionary):
            return MeasuringDevice(dictionary, channels)
        measuring_device.scale_by_unit(dictionary, direct)
    if number == 406 and kind not in ROTARY and _positions(dictionary):
        return Encoder(dictionary, channels)
    if number == 402 and all(dictionary.number(*place) for place in drive.REQUIRED):
        return Drive(dictionary, channels, emergency)
    if number == 408 and all(dictionary.number(*place) for place in valve.REQUIRED):
        return ValveDriver(dictionary, channels, emergency)
    if dictionary.named(amplifier.ENABLE) or dictionary.named(amplifier.RAMP_TIME):
        return Amplifier(dictionary)
    return NoProfile()


def _positions(dictionary: Dictionary) -> bool:
    """Return whether there is a position object whose scale is not set in the configuration."""
    entries = [dictionary.number(POSITION), dictionary.number(MULTI_POSITION, 1)]
    return any(entries) and not any(dictionary.scaled(entry) for entry in entries)
