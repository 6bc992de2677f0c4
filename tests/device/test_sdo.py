"""The SDO server: with a stock client, and with raw requests for protocol errors."""

import pytest
from device_master import NODE_ID, READINGS, SDO_ANSWER, SDO_REQUEST, TPDO1, Master

from hil_emulator.frame import Frame

NAME = b"Hydraulic actuator emulator"


def aborted(answer: str) -> int:
    """Return the code of an abort message; the test fails if the answer is something else."""
    assert answer.startswith("80"), answer
    return int.from_bytes(bytes.fromhex(answer)[4:], "little")


def test_device_type_is_read_expedited(master: Master) -> None:
    """0x1000 is read in one frame with the size indicated, and names CiA 408."""
    assert master.request("4000100000000000") == "4300100098010000"


def test_strings_are_read_in_segments(master: Master) -> None:
    """A stock client reads the device name, which is longer than a frame."""
    assert master.remote.sdo.upload(0x1008, 0) == NAME


def test_segmented_upload_on_the_wire(master: Master) -> None:
    """The size comes first, the toggle bit alternates, the last segment is marked and padded."""
    assert master.request("4008100000000000") == "410810001b000000"
    heads = [master.request(toggle + "00" * 7)[:2] for toggle in ("60", "70", "60", "70")]
    # 27 bytes: three full segments, then one with one byte of padding (n = 1 in bits 1 to 3)
    assert heads == ["00", "10", "00", "13"]


@pytest.mark.parametrize("segmented", [False, True])
def test_written_values_are_read_back(master: Master, segmented: bool) -> None:
    """A write of the stock client is stored, expedited or segmented."""
    master.remote.sdo.download(0x1017, 0, b"\x34\x12", force_segment=segmented)
    assert master.remote.sdo[0x1017].raw == 0x1234


def test_read_shows_the_sample_of_the_same_tick(master: Master) -> None:
    """An SDO read and the tick's TPDO have the same value."""
    master.start()
    master.measure((12.0e6, *READINGS[1:]))
    request = Frame(SDO_REQUEST, bytes.fromhex("4010200000000000"))
    answers = {frame.can_id: frame.data for frame in master.network.tick(request)}
    assert answers[SDO_ANSWER][4:6] == answers[TPDO1][:2] == (12_000).to_bytes(2, "little")


@pytest.mark.parametrize(
    ("index", "subindex", "code"),
    [(0x1004, 0, 0x06020000), (0x1000, 1, 0x06090011), (0x1018, 5, 0x06090011)],
)
def test_absent_objects_are_refused(master: Master, index: int, subindex: int, code: int) -> None:
    """An absent object and an absent sub-index have different codes, for read and write."""
    assert master.abort_code(index, subindex) == code
    assert master.abort_code(index, subindex, b"\0") == code


@pytest.mark.parametrize("index", [0x1000, 0x1001, 0x1008, 0x2010])
def test_read_only_objects_refuse_writes(master: Master, index: int) -> None:
    """Objects of access type ro and const abort with 0601 0002, expedited and segmented."""
    assert master.abort_code(index, 0, bytes(4)) == 0x06010002
    assert master.abort_code(index, 0, bytes(9)) == 0x06010002


@pytest.mark.parametrize("segmented", [False, True])
@pytest.mark.parametrize(
    ("data", "code"), [(bytes(4), 0x06070012), (bytes(3), 0x06070012), (bytes(1), 0x06070013)]
)
def test_wrong_lengths_are_refused(master: Master, data: bytes, code: int, segmented: bool) -> None:
    """UNSIGNED16 accepts exactly two bytes, expedited or segmented."""
    if segmented:
        size = len(data).to_bytes(4, "little").hex()
        assert aborted(master.request("21171000" + size)) == code
    else:
        assert master.abort_code(0x1017, 0, data) == code
    assert master.remote.sdo[0x1017].raw == 100


def test_expedited_write_without_size_takes_the_objects_length(master: Master) -> None:
    """With the size not indicated, the object's length is used."""
    assert master.request("22171000d2040000") == "6017100000000000"
    assert master.remote.sdo[0x1017].raw == 1234


def test_segmented_write_longer_than_announced_is_refused(master: Master) -> None:
    """One byte instead of two announced bytes is a length mismatch."""
    assert master.request("2117100002000000") == "6017100000000000"
    assert aborted(master.request("0d01000000000000")) == 0x06070010


@pytest.mark.parametrize(
    ("value", "code"), [(10_000_001, 0x06090031), (-10_000_001, 0x06090032), (10_000_000, 0)]
)
def test_limits_of_the_eds_are_kept(master: Master, value: int, code: int) -> None:
    """Values beyond LowLimit and HighLimit are refused and do not change the object."""
    data = value.to_bytes(4, "little", signed=True)
    assert master.abort_code(0x2001, 0, data) == code
    assert master.remote.sdo["valve_current_safe"].raw == (1_000_000 if code else value)


@pytest.mark.parametrize("request_", ["e000100000000000", "ff00100000000000"])
def test_unknown_commands_are_refused(master: Master, request_: str) -> None:
    """An undefined command specifier aborts with 0504 0001."""
    assert aborted(master.request(request_)) == 0x05040001


@pytest.mark.parametrize("request_", ["6000000000000000", "0000000000000000"])
def test_segments_without_a_transfer_are_refused(master: Master, request_: str) -> None:
    """A segment without a transfer aborts with 0504 0001."""
    assert aborted(master.request(request_)) == 0x05040001


@pytest.mark.parametrize(
    ("initiate", "segment"),
    [("4008100000000000", "7000000000000000"), ("2117100002000000", "1b01000000000000")],
)
def test_toggle_bit_must_alternate(master: Master, initiate: str, segment: str) -> None:
    """The first segment has toggle 0; 0503 0000 otherwise, with the transfer's object."""
    answer = master.request(initiate)
    abort = master.request(segment)
    assert aborted(abort) == 0x05030000
    assert abort[2:8] == answer[2:8]


def test_repeated_toggle_is_refused(master: Master) -> None:
    """A segment requested twice aborts the transfer."""
    master.request("4008100000000000")
    master.request("6000000000000000")
    assert aborted(master.request("6000000000000000")) == 0x05030000
    assert aborted(master.request("7000000000000000")) == 0x05040001


def test_silent_client_times_out(master: Master) -> None:
    """1 s after the last segment the server aborts once with 0504 0000."""
    master.request("4008100000000000")
    master.run(998)
    before = len(master.data(SDO_ANSWER))
    master.run(3)
    late = master.data(SDO_ANSWER)[before:]
    assert [answer.hex() for answer in late] == ["8008100000000405"]
    master.run(2000)
    assert len(master.data(SDO_ANSWER)) == before + 1


def test_client_may_abort(master: Master) -> None:
    """After the client's abort the server is silent and ready for the next transfer."""
    master.request("4008100000000000")
    assert master.request("8008100000000405") == ""
    assert aborted(master.request("6000000000000000")) == 0x05040001
    assert master.remote.sdo.upload(0x1008, 0) == NAME


def test_new_request_replaces_an_unfinished_transfer(master: Master) -> None:
    """A client that restarts a transfer is served."""
    master.request("4008100000000000")
    assert master.request("4000100000000000") == "4300100098010000"


@pytest.mark.parametrize("length", [0, 1, 7])
def test_short_frames_are_no_requests(master: Master, length: int) -> None:
    """A frame of other than eight bytes is not an SDO and is not answered."""
    assert master.request("4000100000000000"[: 2 * length]) == ""


def test_several_requests_in_one_tick_are_all_answered(master: Master) -> None:
    """Requests that arrive together are answered in their order."""
    write = Frame(SDO_REQUEST, bytes.fromhex("2b17100032000000"))
    read = Frame(SDO_REQUEST, bytes.fromhex("4017100000000000"))
    frames = master.network.tick(read, write, read)
    answers = [frame.data.hex() for frame in frames if frame.can_id == SDO_ANSWER]
    assert answers == ["4b17100064000000", "6017100000000000", "4b17100032000000"]


def test_server_parameter_has_the_identifiers(master: Master) -> None:
    """0x1200 holds the identifiers that the server uses."""
    assert master.remote.sdo[0x1200][1].raw == 0x600 + NODE_ID
    assert master.remote.sdo[0x1200][2].raw == 0x580 + NODE_ID


def test_every_readable_object_of_the_eds_is_there(master: Master) -> None:
    """A stock client reads all objects of the EDS; only the empty error history has no data."""
    for index, item in master.remote.object_dictionary.items():
        if index < 0x1000:
            continue
        variables = item.values() if hasattr(item, "subindices") else [item]
        for variable in variables:
            code = master.abort_code(index, variable.subindex)
            empty = index == 0x1003 and variable.subindex > 0
            assert code == (0x08000024 if empty else 0), variable
