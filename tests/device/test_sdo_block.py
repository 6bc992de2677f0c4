"""SDO block transfers: with a stock client, and with raw frames for lost segments."""

from pathlib import Path

import canopen
import pytest
from device_master import CHANNELS, NODE_ID, SDO_ANSWER, SDO_REQUEST, Master, booted
from edited_eds import added, edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node
from hil_emulator.device.sdo_block import crc
from hil_emulator.frame import Frame

DOMAIN, LOG = 0x0F, 0x2FFF
TEXT = bytes(range(256)) * 4


@pytest.fixture
def log_master(tmp_path: Path) -> Master:
    """Return a master of a device with a writable DOMAIN at 0x2FFF."""
    eds = edited(tmp_path, added(f"{LOG:04X}", DOMAIN))
    return booted(Node(Dictionary.from_eds(eds, NODE_ID), CHANNELS, {"valve_current": 0.0}), eds)


def answers(master: Master, *requests: str) -> list[str]:
    """Return the answers to requests that arrive in one tick."""
    frames = [Frame(SDO_REQUEST, bytes.fromhex(text)) for text in requests]
    return [f.data.hex() for f in master.network.tick(*frames) if f.can_id == SDO_ANSWER]


def aborted(master: Master, request: str) -> int:
    """Return the abort code of a request."""
    (answer,) = answers(master, request)
    assert answer.startswith("80"), answer
    return int.from_bytes(bytes.fromhex(answer)[4:], "little")


def segment(number: int, data: bytes, *, last: bool = False) -> str:
    """Return a segment of a block."""
    return (bytes([number | 0x80 * last]) + data.ljust(7, b"\0")).hex()


def test_checksum_is_crc_16_xmodem() -> None:
    """The check value of "123456789" is 0x31C3 (CiA 301)."""
    assert crc(b"123456789") == 0x31C3


@pytest.mark.parametrize("length", [1, 7, 8, 889, 890, 1024])
@pytest.mark.parametrize("checked", [True, False])
def test_stock_client_writes_and_reads_blocks(
    log_master: Master, length: int, checked: bool
) -> None:
    """Data of any length survive a block download and a block upload of the stock client."""
    sdo, data = log_master.remote.sdo, TEXT[:length]
    with sdo.open(
        LOG, 0, "wb", size=length, block_transfer=True, request_crc_support=checked
    ) as stream:
        stream.write(data)
    with sdo.open(LOG, 0, "rb", block_transfer=True, request_crc_support=checked) as stream:
        assert stream.read() == data


def test_lost_download_segment_is_requested_again(log_master: Master) -> None:
    """The acknowledgement names the last segment in sequence, after which the client continues."""
    assert answers(log_master, "c2ff2f000f000000") == ["a4ff2f007f000000"]
    first, lost, third = b"abcdefg", b"hijklmn", b"o"
    assert answers(log_master, segment(1, first), segment(3, third, last=True)) == [
        "a2017f0000000000"
    ]
    assert answers(log_master, segment(1, lost), segment(2, third, last=True)) == [
        "a2027f0000000000"
    ]
    assert answers(log_master, "d900000000000000") == ["a100000000000000"]
    assert log_master.remote.sdo.upload(LOG, 0) == first + lost + third


def test_wrong_checksum_stores_nothing(log_master: Master) -> None:
    """With CRC agreed, a wrong checksum aborts with 0504 0004."""
    answers(log_master, "c6ff2f0007000000")
    answers(log_master, segment(1, b"abcdefg", last=True))
    assert aborted(log_master, "c100000000000000") == 0x05040004
    assert log_master.remote.sdo.upload(LOG, 0) == b""


def test_wrong_length_stores_nothing(log_master: Master) -> None:
    """Six bytes of seven announced abort with 0607 0010."""
    answers(log_master, "c2ff2f0007000000")
    answers(log_master, segment(1, b"abcdef", last=True))
    assert aborted(log_master, "c500000000000000") == 0x06070010
    assert log_master.remote.sdo.upload(LOG, 0) == b""


def test_segment_number_zero_is_refused(log_master: Master) -> None:
    """A segment's number is 1 to 127; 0504 0003 otherwise."""
    answers(log_master, "c2ff2f0007000000")
    assert aborted(log_master, segment(0, b"abcdefg")) == 0x05040003


def test_block_download_of_a_number(log_master: Master) -> None:
    """Objects of fixed length can be written in blocks, and the length is checked early."""
    assert aborted(log_master, "c217100004000000") == 0x06070012
    answers(log_master, "c217100002000000")
    answers(log_master, segment(1, b"\xc8\0", last=True))
    assert answers(log_master, "d500000000000000") == ["a100000000000000"]
    assert log_master.remote.sdo[0x1017].raw == 200


@pytest.mark.parametrize("block", [True, False])
def test_data_beyond_the_capacity_are_refused_at_once(log_master: Master, block: bool) -> None:
    """600,000 bytes announced for a DOMAIN that takes 131,072 abort the initiate: 0607 0012."""
    sdo = log_master.remote.sdo
    with pytest.raises(canopen.SdoAbortedError) as abort:
        sdo.open(LOG, 0, "wb", size=600_000, block_transfer=block)
    assert abort.value.code == 0x06070012


def test_no_segment_is_read_as_a_request(
    log_master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Data that exceed the length within a block are refused at its end, not at segment 0x2B."""
    monkeypatch.setattr("hil_emulator.device.sdo_segmented.MAX_DOWNLOAD", 70)
    answers(log_master, "c0ff2f0000000000")
    request = bytes.fromhex("17100007000000")
    block = [segment(number, request) for number in range(1, 128)]
    assert answers(log_master, *block) == ["80ff2f0005000405"]
    assert log_master.remote.sdo[0x1017].raw != 7


def test_a_client_without_checksums_receives_zero(log_master: Master) -> None:
    """The end of an upload carries 0 if the client requested no checksum (7.2.4.3.15)."""
    answers(log_master, "a008100004000000")
    answers(log_master, "a300000000000000")
    assert answers(log_master, "a204040000000000") == ["c500000000000000"]


def test_read_only_objects_refuse_blocks(log_master: Master) -> None:
    """Access is checked when a block transfer begins."""
    assert aborted(log_master, "c200100004000000") == 0x06010002


@pytest.mark.parametrize("size", [0, 128, 255])
def test_block_size_has_a_range(log_master: Master, size: int) -> None:
    """A block has 1 to 127 segments; other sizes abort with 0504 0002, at the start and later."""
    assert aborted(log_master, f"a0081000{size:02x}000000") == 0x05040002
    answers(log_master, "a008100001000000")
    answers(log_master, "a300000000000000")
    assert aborted(log_master, f"a201{size:02x}0000000000") == 0x05040002


def test_upload_repeats_what_was_not_acknowledged(log_master: Master) -> None:
    """After an acknowledgement of segment 1 of 2, the block begins with the second."""
    assert answers(log_master, "a408100002000000") == ["c60810001b000000"]
    first = answers(log_master, "a300000000000000")
    assert [text[:2] for text in first] == ["01", "02"]
    again = answers(log_master, "a201030000000000")
    assert [text[:2] for text in again] == ["01", "02", "83"]
    assert again[0][2:] == first[1][2:]
    end = answers(log_master, "a203030000000000")
    checksum = crc(b"Hydraulic actuator emulator").to_bytes(2, "little").hex()
    assert end == ["c5" + checksum + "00" * 5]
    assert answers(log_master, "a100000000000000") == []
    assert log_master.remote.sdo.upload(0x1008, 0) == b"Hydraulic actuator emulator"


def test_acknowledging_the_unsent_is_refused(log_master: Master) -> None:
    """A client cannot have received what was not sent: 0504 0003."""
    answers(log_master, "a008100001000000")
    answers(log_master, "a300000000000000")
    assert aborted(log_master, "a202010000000000") == 0x05040003


@pytest.mark.parametrize(("threshold", "head"), [(0, "c6"), (26, "c6"), (27, "41"), (255, "41")])
def test_client_may_prefer_segments_for_short_data(
    log_master: Master, threshold: int, head: str
) -> None:
    """Up to the client's threshold the device answers as for a segmented upload."""
    (answer,) = answers(log_master, f"a40810007f{threshold:02x}0000")
    assert answer[:2] == head


def test_stray_block_requests_are_refused(log_master: Master) -> None:
    """Start, acknowledgement and end without a transfer abort with 0504 0001."""
    for request in ("a300000000000000", "a201010000000000", "a100000000000000", "c1" + "00" * 7):
        assert aborted(log_master, request) == 0x05040001


def test_silent_block_client_times_out(log_master: Master) -> None:
    """One second without a segment ends the transfer with 0504 0000."""
    answers(log_master, "c2ff2f0007000000")
    log_master.forget()
    log_master.run(1001)
    assert [data.hex() for data in log_master.data(SDO_ANSWER)] == ["80ff2f0000000405"]
