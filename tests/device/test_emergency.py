"""EMCY, error register and error history (CiA 301 7.2.7), with a stock consumer."""

import pytest
from device_master import EMCY, NODE_ID, SYNC, Master

from hil_emulator.device.emergency import ErrorBit

QUIET = (0, 0, 0, 0, 0)


def received(master: Master) -> list[tuple[int, int, bytes]]:
    """Return code, error register and manufacturer bytes of the stock consumer's log."""
    return [(entry.code, entry.register, entry.data) for entry in master.remote.emcy.log]


def test_overrange_names_channel_and_direction(master: Master) -> None:
    """Each channel has the code 0xFF10 plus its position; byte 2 shows above or below."""
    master.measure(overrange=(0, 1, 0, -1, 0))
    master.run(5)
    assert received(master) == [
        (0xFF11, 0x81, b"\x01\x01\0\0\0"),
        (0xFF13, 0x81, b"\x03\xff\0\0\0"),
    ]
    assert master.remote.sdo[0x1001].raw == 0x81


def test_error_reset_is_sent_after_the_last_error(master: Master) -> None:
    """No reset is sent while a channel is outside its range."""
    master.measure(overrange=(0, 1, 0, -1, 0))
    master.run(2)
    master.measure(overrange=(0, 0, 0, -1, 0))
    master.run(2)
    assert len(received(master)) == 2
    master.measure(overrange=QUIET)
    master.run(2)
    assert received(master)[2:] == [(0x0000, 0x00, bytes(5))]
    assert master.remote.emcy.active == []
    assert master.remote.sdo[0x1001].raw == 0


def test_change_of_direction_is_reported(master: Master) -> None:
    """A channel that goes from above to below its range is reported again, without a reset."""
    for direction in (1, -1):
        master.measure(overrange=(direction, 0, 0, 0, 0))
        master.run(2)
    assert [data for _, _, data in received(master)] == [b"\0\x01\0\0\0", b"\0\xff\0\0\0"]


def test_history_has_the_newest_first(master: Master) -> None:
    """0x1003 keeps code and two manufacturer bytes, eight errors at most."""
    assert master.abort_code(0x1003, 1) == 0x08000024
    for count in range(1, 11):
        master.measure(overrange=(count % 2 * 2 - 1, 0, 0, 0, 0))
        master.run(1)
    master.measure(overrange=(-1, 0, 0, 0, 1))
    master.run(1)
    assert master.remote.sdo[0x1003][0].raw == 8
    assert master.remote.sdo[0x1003][1].raw == 0x0104_FF14
    assert master.remote.sdo[0x1003][2].raw == 0xFF00_FF10
    assert master.remote.sdo[0x1003][3].raw == 0x0100_FF10


def test_history_is_emptied_by_writing_zero(master: Master) -> None:
    """Only 0 may be written; then there is no error to read."""
    master.measure(overrange=(1, 0, 0, 0, 0))
    master.run(1)
    assert master.abort_code(0x1003, 0, b"\1") == 0x06090030
    assert master.remote.sdo[0x1003][0].raw == 1
    assert master.abort_code(0x1003, 0, b"\0") == 0
    assert master.remote.sdo[0x1003][0].raw == 0
    assert master.abort_code(0x1003, 1) == 0x08000024
    assert master.remote.sdo[0x1001].raw == 0x81


def test_inhibit_time_spaces_messages(master: Master) -> None:
    """0x1015 in units of 100 us separates messages, and no message is lost."""
    master.remote.sdo[0x1015].raw = 50
    master.measure(overrange=(1, 1, 1, 1, 1))
    master.run(30)
    times = master.times_ms(EMCY)
    assert [t - times[0] for t in times] == [0, 5, 10, 15, 20]


def test_cob_id_can_be_moved_and_switched_off(master: Master) -> None:
    """0x1014 changes the identifier of EMCY; bit 31 disables EMCY, but not the history."""
    off = 1 << 31
    assert master.abort_code(0x1014, 0, (0x0A5).to_bytes(4, "little")) == 0x06090030
    master.remote.sdo[0x1014].raw = off | EMCY
    master.measure(overrange=(1, 0, 0, 0, 0))
    master.run(2)
    assert master.data(EMCY) == []
    assert master.remote.sdo[0x1003][0].raw == 1
    master.remote.sdo[0x1014].raw = 0x0A5
    master.measure(overrange=(1, 1, 0, 0, 0))
    master.run(2)
    assert len(master.data(0x0A5)) == 1


def test_reset_reports_again_what_is_still_wrong(master: Master) -> None:
    """After reset communication an error that persists is sent once more."""
    master.measure(overrange=(1, 0, 0, 0, 0))
    master.run(2)
    master.nmt(130)
    master.forget()
    master.run(3)
    assert len(master.data(EMCY)) == 1


def test_default_cob_id(master: Master) -> None:
    """0x1014 is 0x80 plus the node's number."""
    assert master.remote.sdo[0x1014].raw == 0x80 + NODE_ID


@pytest.mark.parametrize("data", [b"\x01", bytes(8)])
def test_sync_of_wrong_length_is_reported(master: Master, data: bytes) -> None:
    """A SYNC with unexpected data is ignored: EMCY 0x8240 until a correct SYNC."""
    master.start()
    master.send(SYNC, data)
    assert received(master) == [(0x8240, 0x11, bytes(5))]
    assert master.data(0x480 + NODE_ID) == []
    master.send(SYNC)
    assert [code for code, _, _ in received(master)] == [0x8240, 0x0000]


def test_held_back_messages_are_bounded(master: Master) -> None:
    """If a sensor often leaves its range in STOPPED, only the newest 64 messages are kept."""
    master.nmt(2)
    for count in range(200):
        master.measure(overrange=(count % 2, 0, 0, 0, 0))
        master.run(1)
    master.nmt(128)
    assert len(master.data(EMCY)) == 64


def test_hardware_around_the_node_reports_through_it(master: Master) -> None:
    """An error of the hardware is sent once, shows in 0x1001 and ends with the error reset."""
    for _ in range(3):
        master.network.node.raise_error("supply", 0x3412, ErrorBit.MANUFACTURER)
        master.run(1)
    assert received(master) == [(0x3412, 0x81, bytes(5))]
    master.network.node.clear_error("supply")
    master.run(1)
    assert received(master)[1:] == [(0x0000, 0x00, bytes(5))]
