"""The socketcand protocol: bytes to frames, and frames to bytes."""

import random

import pytest
from can.interfaces.socketcand.socketcand import (
    convert_ascii_message_to_can_message,
    convert_can_message_to_ascii_message,
)
from hypothesis import given
from hypothesis import strategies as st
from wires import frame_of, message_of

from hil_emulator.bus.socketcand import MAX_COMMAND, CommandStream, format_frames, parse_send
from hil_emulator.frame import Frame

data_frame = {"data": st.binary(max_size=8), "remote": st.just(False)}
standard = st.builds(Frame, can_id=st.integers(0, 0x7FF), extended=st.just(False), **data_frame)
extended = st.builds(
    Frame, can_id=st.integers(0, 0x1FFF_FFFF), extended=st.just(True), **data_frame
)
frames = standard | extended


@given(frames)
def test_we_read_what_the_stock_client_writes(frame: Frame) -> None:
    """Every classical data frame of python-can's client is read."""
    line = convert_can_message_to_ascii_message(message_of(frame)).encode()
    [command] = CommandStream().feed(line)
    assert parse_send(command) == frame


@given(frames, st.floats(0.0, 4e9))
def test_the_stock_client_reads_what_we_write(frame: Frame, time: float) -> None:
    """Python-can's client reads every frame that we write, including frames without data."""
    message = convert_ascii_message_to_can_message(format_frames([frame], time).decode())
    assert frame_of(message) == frame
    assert message.timestamp == pytest.approx(time, abs=1e-6)


def test_a_frame_reads_as_in_the_protocol_description() -> None:
    """The documented example, byte by byte."""
    line = format_frames([Frame(0x123, bytes.fromhex("1122334455667788"))], 23.424242)
    assert line == b"< frame 123 23.424242 1122334455667788 >"
    assert parse_send(b" send 123 4 1a 22 3 44 ") == Frame(0x123, bytes.fromhex("1a220344"))


@pytest.mark.parametrize(
    "command",
    [
        "",
        "send",
        "send 123",
        "send 123 9",
        "send 123 1 11 22",
        "send 123 2 11",
        "send 123 1 111",
        "send 123 1 zz",
        "send 123 9 1 2 3 4 5 6 7 8 9",
        "send 123 -1",
        "send 800 0",
        "send 1234 0",
        "send 20000000 0",
        "send 0x1 0",
        "send 123456789 0",
        "sent 123 0",
        "send 123 0 >",
        "frame 123 1.0 11",
    ],
)
def test_an_ill_formed_command_is_no_frame(command: str) -> None:
    """Commands with wrong lengths, identifiers or words are dropped."""
    assert parse_send(command.encode()) is None


@given(st.binary(max_size=400), st.lists(st.integers(1, 50)))
def test_segmentation_does_not_matter(stream: bytes, cuts: list[int]) -> None:
    """TCP may divide the stream anywhere: the commands are the same."""
    whole, pieces = CommandStream(), CommandStream()
    expected, got, rest = whole.feed(stream), [], stream
    for cut in cuts:
        got += pieces.feed(rest[:cut])
        rest = rest[cut:]
    assert got + pieces.feed(rest) == expected


PIECES = [
    "< send 80 0 >", "< send 205 4 20 A1 7 0f >", "< send 185 8  >", "< send 1 2 3 >", "<",
    "< send 800 0 >", "< send 00000123 1 ff >", " ", "\n", "x", "< echo >", ">", "< send",
]  # fmt: skip


def obeyed(stream: CommandStream, chunk: bytes) -> list[Frame]:
    """Return the frames of a chunk, command by command."""
    return [f for f in map(parse_send, stream.feed(chunk)) if f is not None]


@given(st.lists(st.sampled_from(PIECES), max_size=6), st.sampled_from([b"", b"<", b"< sen"]))
def test_whole_commands_are_read_at_once_as_one_by_one(parts: list[str], before: bytes) -> None:
    """`sends` returns the same frames as `feed` and `parse_send`, and leaves no rest."""
    chunk, stream, other = "".join(parts).encode(), CommandStream(), CommandStream()
    assert stream.feed(before) == other.feed(before) == []
    taken = stream.sends(chunk)
    if taken is None:
        taken = obeyed(stream, chunk)
    assert taken == obeyed(other, chunk)
    assert stream._unfinished == other._unfinished


@given(st.lists(frames, max_size=8))
def test_what_the_stock_client_writes_is_read_at_once(several: list[Frame]) -> None:
    """Several commands are read together, including frames without data."""
    lines = "".join(convert_can_message_to_ascii_message(message_of(f)) for f in several)
    assert CommandStream().sends(lines.encode()) == several


@given(st.lists(st.sampled_from(["<", ">", " ", "a" * 40, "send 1 0"])), st.integers(1, 7))
def test_segmentation_does_not_matter_among_brackets(parts: list[str], step: int) -> None:
    """The same for streams of protocol elements, including commands that are too long."""
    stream = "".join(parts).encode()
    pieces = CommandStream()
    got = [c for i in range(0, len(stream), step) for c in pieces.feed(stream[i : i + step])]
    assert got == CommandStream().feed(stream)


@given(st.binary(max_size=300), frames)
def test_a_command_after_garbage_is_understood(garbage: bytes, frame: Frame) -> None:
    """A complete command after garbage is read."""
    line = convert_can_message_to_ascii_message(message_of(frame)).encode()
    assert parse_send(CommandStream().feed(garbage + line)[-1]) == frame


def test_an_endless_command_is_forgotten() -> None:
    """A command without end uses limited memory, and a new command is read."""
    stream = CommandStream()
    for _ in range(1000):
        assert stream.feed(b"<" + b"x" * MAX_COMMAND) == []
        assert stream.feed(b"x") == []
    assert len(stream._unfinished) <= MAX_COMMAND + 1
    assert stream.feed(b"> < ok >") == [b" ok "]


def test_random_bytes_are_survived() -> None:
    """100 000 random bytes, mostly brackets, raise no error and leave a short rest."""
    noise = random.Random(1)
    alphabet = [*range(256), *b"<<<<>>>>send 0123"]
    stream = CommandStream()
    for _ in range(1000):
        for command in stream.feed(bytes(noise.choices(alphabet, k=100))):
            parse_send(command)
        assert len(stream._unfinished) <= MAX_COMMAND + 1


def test_a_length_without_data_is_that_of_a_remote_frame() -> None:
    """Python-can's client writes a remote frame as a length without data."""
    assert parse_send(b" send 185 8  ") == Frame(0x185, remote=True)
