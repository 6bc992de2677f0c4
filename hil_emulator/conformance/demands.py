"""When a case does not apply: the service it is about is optional, and absent."""

import pytest

from hil_emulator.conformance.device import EMCY_COB_ID, SYNC_COB_ID, Device

NO_SUCH_OBJECT = frozenset({0x0602_0000, 0x0800_0000})


def need_object(device: Device, index: int, subindex: int = 0) -> None:
    """Skip the case where the EDS has no such object: the service is not offered."""
    if (index, subindex) not in device.eds:
        pytest.skip(f"the EDS has no object {index:04X}:{subindex:02X}")


def need_sync(device: Device) -> None:
    """Skip the case where the device consumes no SYNC, which is optional."""
    need_object(device, SYNC_COB_ID)


def need_emergency(device: Device) -> None:
    """Skip the case where the device sends no emergencies, which is optional."""
    need_object(device, EMCY_COB_ID)


def need_writable(device: Device, index: int, subindex: int = 0) -> None:
    """Skip the case where the EDS has no such object or lets nobody write it."""
    need_object(device, index, subindex)
    if not device.eds.writable(index, subindex):
        pytest.skip(f"{index:04X}:{subindex:02X} cannot be written")


def need_remote_frames(device: Device) -> None:
    """Skip the case where the bus cannot carry the remote frames it is made of."""
    if not device.wire.remote_frames:
        pytest.skip("this bus carries no remote frames")


def need_guarding(device: Device) -> None:
    """Skip the case where there is no node guarding, or no bus for it."""
    need_writable(device, 0x100C)
    need_writable(device, 0x100D)
    need_remote_frames(device)
