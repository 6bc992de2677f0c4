"""A second SDO channel serves a second client (CiA 301 7.5.2.33)."""

import pytest
from device_master import SDO_ANSWER, SDO_REQUEST, Master

REQUEST, ANSWER = 0x6C1, 0x6C2
READ_TYPE = "4000100000000000"
OFF = 0x8000_0000


@pytest.fixture
def second(master: Master) -> Master:
    """Return a node whose second channel has been switched on."""
    master.remote.sdo[0x1201][1].raw = REQUEST
    master.remote.sdo[0x1201][2].raw = ANSWER
    master.forget()
    return master


def ask(master: Master, text: str, request: int = REQUEST, answer: int = ANSWER) -> str:
    """Return the answer on a channel, "" without an answer."""
    before = len(master.data(answer))
    master.send(request, bytes.fromhex(text))
    return "".join(data.hex() for data in master.data(answer)[before:])


def test_the_second_channel_is_off_by_default(master: Master) -> None:
    """Requests are not answered until a client enables the channel."""
    assert ask(master, READ_TYPE) == ""
    assert master.remote.sdo[0x1201][1].raw == OFF


def test_the_second_channel_answers(second: Master) -> None:
    """It returns the same values as the first channel."""
    assert ask(second, READ_TYPE)[8:] == "98010000"
    assert ask(second, READ_TYPE) == ask(second, READ_TYPE, SDO_REQUEST, SDO_ANSWER)


def test_two_transfers_do_not_disturb_each_other(second: Master) -> None:
    """Two clients read a long object segment by segment, in turns."""
    channels = [(REQUEST, ANSWER), (SDO_REQUEST, SDO_ANSWER)]
    texts = ["", ""]
    for request in ("4008100000000000", "6000000000000000", "7000000000000000"):
        for n, (here, there) in enumerate(channels):
            texts[n] += ask(second, request, here, there)
    assert texts[0] == texts[1]
    assert len(texts[0]) == 48


def test_a_channel_needs_both_identifiers(master: Master) -> None:
    """With one of them invalid the channel does not exist."""
    master.remote.sdo[0x1201][1].raw = REQUEST
    assert ask(master, READ_TYPE) == ""


def test_identifiers_of_an_existing_channel_are_locked(second: Master) -> None:
    """They can be changed only after they were made invalid, and never to restricted ones."""
    assert second.abort_code(0x1201, 1, (0x6C5).to_bytes(4, "little")) == 0x06090030
    assert second.abort_code(0x1201, 1, OFF.to_bytes(4, "little")) == 0
    assert ask(second, READ_TYPE) == ""
    assert second.abort_code(0x1201, 1, (0x601).to_bytes(4, "little")) == 0x06090030
    second.remote.sdo[0x1201][1].raw = 0x6C5
    assert ask(second, READ_TYPE, 0x6C5)[8:] == "98010000"


def test_a_reset_switches_the_channel_off(second: Master) -> None:
    """Without storing it does not exist after NMT reset communication."""
    second.nmt(130)
    second.run(2)
    assert ask(second, READ_TYPE) == ""
