"""Conditions for skipping a case: an optional service is absent."""

import pytest

from hil_emulator.conformance.device import EMCY_COB_ID, SYNC_COB_ID, Device

NO_SUCH_OBJECT = frozenset({0x0602_0000, 0x0800_0000})


def need_object(device: Device, index: int, subindex: int = 0) -> None:
    """Skip the case if the EDS lacks the object: the service is absent."""
    if (index, subindex) not in device.eds:
        pytest.skip(f"the EDS has no object {index:04X}:{subindex:02X}")


def need_sync(device: Device) -> None:
    """Skip the case if the device does not consume SYNC, which is optional."""
    need_object(device, SYNC_COB_ID)


def need_emergency(device: Device) -> None:
    """Skip the case if the device sends no emergencies, which are optional."""
    need_object(device, EMCY_COB_ID)


def need_writable(device: Device, index: int, subindex: int = 0) -> None:
    """Skip the case if the EDS lacks the object or a client cannot write it."""
    need_object(device, index, subindex)
    if not device.eds.writable(index, subindex):
        pytest.skip(f"{index:04X}:{subindex:02X} cannot be written")


def need_remote_frames(device: Device) -> None:
    """Skip the case if the bus cannot carry remote frames."""
    if not device.wire.remote_frames:
        pytest.skip("this bus carries no remote frames")


def need_guarding(device: Device) -> None:
    """Skip the case if there is no node guarding, or if the bus carries no remote frames."""
    need_writable(device, 0x100C)
    need_writable(device, 0x100D)
    need_remote_frames(device)
