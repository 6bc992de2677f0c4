"""Nodes at rest send what their services would: the same frames, the same objects."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rigs import START, bench, reference
from session import FAULTS, SYNC, Action, Session, nmt, read, remapped, typed, write

from hil_emulator.frame import Frame
from hil_emulator.simulation.resting_nodes import RestingNodes

Script = Mapping[int, Iterable[Action]]

POSITION, PRESSURE, COUNTER, TIME, FORCE = (
    0x20200020, 0x20100010, 0x20400010, 0x20410020, 0x20300020,
)  # fmt: skip
"""Mapping words of what a TPDO may carry."""

SILENT: Action = ("said",)


def session(script: Script, ticks: int) -> Session:
    """Return what is seen of a session."""
    seen = Session()
    with bench(reference()) as b:
        b.ticks(2)
        b.tick(START)
        seen.run(b, script, ticks)
    return seen


def attended(script: Script, ticks: int) -> Session:
    """Return the same of a session in which no node ever rests."""
    with patch.object(RestingNodes, "settle", lambda self: None):
        return session(script, ticks)


def compare(script: Script, ticks: int) -> Session:
    """Demand the same of both; return it."""
    resting, awake = session(script, ticks), attended(script, ticks)
    assert resting.frames == awake.frames
    assert resting.objects == awake.objects
    assert not awake.rested
    return resting


def test_a_node_that_only_repeats_itself_rests() -> None:
    """Set points, SYNC and four TPDOs in each tick: a heartbeat is what its services wake for."""
    seen = compare({}, 500)
    assert seen.rested > 450
    assert {0x185, 0x285, 0x385, 0x485, 0x705} <= {frame.can_id for _, frame in seen.frames}


def test_reading_an_object_in_every_tick_shows_every_sample() -> None:
    """By SDO and in the dictionary: no object lags behind for who looks at it."""
    asked = (0x2020, 0x2040, 0x2041, 0x2010)
    script = {t: [("frames", read(asked[t % 4])), ("look",)] for t in range(100)}
    compare(script, 120)


@pytest.mark.parametrize(("target", "kind"), FAULTS)
def test_a_fault_does_to_a_resting_node_what_it_does_to_any(target: str, kind: str) -> None:
    """Faults of every kind, begun and ended while the node rests."""
    seen = compare({50: [("fault", target, kind, "60 ms")], 110: [("look",)]}, 200)
    assert seen.rested >= 50


KINDS = [(0, 0, 0), (1, 0, 0), (3, 0, 0), (252, 0, 0), (253, 0, 0), (254, 0, 0), (255, 0, 0),
         (254, 2, 0), (255, 3, 0), (254, 1, 15), (255, 0, 15)]  # fmt: skip
"""Transmission type, event timer [ms], inhibit time [0.1 ms]."""


@pytest.mark.parametrize(("kind", "timer", "inhibit"), KINDS)
def test_every_transmission_type_is_kept(kind: int, timer: int, inhibit: int) -> None:
    """Synchronous, on request and event-driven TPDOs come as they came, asked for or not."""
    asked: list[Action] = [("frames", Frame(0x285, remote=True))]
    script: Script = {
        20: [("requests", *typed(2, kind, timer, inhibit))], 60: asked, 61: [("said", SYNC, SYNC)],
        62: [SILENT], 63: asked, 90: [("said", SYNC)], 91: [SILENT],
    }  # fmt: skip
    compare(script, 150)


def test_a_master_goes_through_all_services() -> None:
    """Remapping, NMT, LSS, a lost controller, guarding, parameters, a range left and entered."""
    lss = [Frame(0x7E5, bytes([4, 1, *[0] * 6])), Frame(0x7E5, bytes([0x5E, *[0] * 7]))]
    script: Script = {
        20: [("requests", *remapped(1, [POSITION, COUNTER, PRESSURE]))],
        60: [("requests", *remapped(2, [TIME, FORCE]), *remapped(3, [POSITION]))],
        120: [("frames", nmt(2))], 125: [("frames", *lss)], 130: [("frames", nmt(129))],
        140: [("frames", nmt(1))], 160: [SILENT], 200: [("frames", nmt(128))],
        205: [("frames", nmt(1))], 220: [("set", "supply_pressure", 300e5)],
        240: [("look",)], 260: [("set", "supply_pressure", 160e5)],
        300: [("requests", write(0x1017, 0, 7, 2), write(0x1400, 5, 9, 2))],
        **{t: [SILENT] for t in range(330, 345)},
        360: [("said", Frame(0x205, b"\1"), SYNC)], 370: [("said", Frame(0x205, bytes(6)))],
        380: [("said", Frame(0x080, b"\1"))], 400: [("frames", Frame(0x705, remote=True))],
        420: [("serve", read(0x2020), SYNC, SYNC)], 440: [("set", "valve_current", 1e-3)],
        450: [("requests", write(0x2001, 0, 1000, 4), write(0x1019, 0, 10, 1))],
        470: [("said", Frame(0x080, b"\3"))], 480: [("frames", nmt(130))],
        490: [("frames", nmt(1))],
    }  # fmt: skip
    seen = compare(script, 560)
    assert seen.rested > 300


def two_nodes() -> tuple[list[Frame], int]:
    """Return what two nodes of a rig send, one of them remapped and reset, and how often both rest.

    The second produces a heartbeat that the first consumes, and its third TPDO comes on request.
    """
    first = reference().nodes[0]
    second = dataclasses.replace(first, id=6, commands={"valve_current": 0.0})
    events = {
        20: [Frame(0x605, bytes.fromhex("23161001 2c010600"))],  # consumes what node 6 produces
        **{60 + 2 * i: [frame] for i, frame in enumerate(remapped(1, [POSITION, COUNTER]))},
        90: [Frame(0x385 + 1, remote=True)],
        110: [Frame(0x000, bytes([129, 6]))],
        130: [Frame(0x000, bytes([1, 6]))],
        150: [Frame(0x606, bytes.fromhex("2b171000 00000000"))],  # falls silent
    }
    rested = 0
    with bench(dataclasses.replace(reference(), nodes=(first, second))) as b:
        b.ticks(2)
        b.tick(Frame(0x000, bytes([1, 0])))
        for tick in range(500):
            b.tick(*events.get(tick, ()), SYNC)
            rested += all(node.rest.on for node in b.rig.nodes)
        return b.heard, rested


def test_each_of_several_nodes_rests_by_itself() -> None:
    """A node that is remapped moves its neighbour's part of the record, and nothing else."""
    heard, rested = two_nodes()
    with patch.object(RestingNodes, "settle", lambda self: None):
        assert two_nodes() == (heard, 0)
    assert rested > 250
    assert {0x185, 0x186, 0x286, 0x386, 0x486, 0x706, 0x085} <= {frame.can_id for frame in heard}


def actions() -> Iterator[st.SearchStrategy[Action]]:
    """Yield what may happen in a session."""
    words = st.lists(
        st.sampled_from([POSITION, PRESSURE, COUNTER, TIME, FORCE]), min_size=1, max_size=3
    )
    number = st.integers(1, 4)
    yield st.sampled_from([1, 1, 1, 2, 128, 129, 130]).map(lambda c: ("frames", nmt(c)))
    yield st.sampled_from([0x2020, 0x2040, 0x1003, 0x1001]).map(lambda i: ("requests", read(i)))
    yield st.builds(lambda n, kind: ("requests", *typed(n, *kind)), number, st.sampled_from(KINDS))
    yield st.builds(lambda n, w: ("requests", *remapped(n, w)), number, words)
    yield st.sampled_from([0, 3, 20]).map(lambda ms: ("requests", write(0x1017, 0, ms, 2)))
    yield st.sampled_from([0, 2, 4]).map(lambda n: ("requests", write(0x1019, 0, n, 1)))
    yield st.sampled_from([0, 1, 255]).map(lambda n: ("requests", write(0x1400, 2, n, 1)))
    yield st.lists(
        st.sampled_from([SYNC, Frame(0x80, b"\2"), Frame(0x205, b"\1"), Frame(0x205, bytes(4))]),
        max_size=4,
    ).map(lambda frames: ("said", *frames))
    yield st.sampled_from([0x185, 0x485, 0x705]).map(lambda i: ("frames", Frame(i, remote=True)))
    yield st.builds(
        lambda fault, ms: ("fault", *fault, f"{ms} ms"), st.sampled_from(FAULTS), st.integers(1, 30)
    )
    yield st.sampled_from([300e5, 160e5]).map(lambda p: ("set", "supply_pressure", p))
    yield st.just(("look",))
    yield st.just(("serve", read(0x2030), SYNC))


SCRIPTS = st.dictionaries(
    st.integers(0, 250), st.lists(st.one_of(*actions()), max_size=3), max_size=25
)


@settings(max_examples=25, deadline=None, derandomize=True, database=None,
          suppress_health_check=list(HealthCheck))  # fmt: skip
@given(SCRIPTS)
def test_whatever_happens_a_resting_node_is_like_any(script: Script) -> None:
    """Events of all kinds in any order."""
    compare(script, 300)
