"""On and off the fast path a node sends the same frames and has the same objects."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rigs import START, bench
from service_sessions import SESSIONS, SILENT, Script, ServiceSession, machine
from session import FAULTS, SYNC, Action, Session, nmt, read, remapped, typed, write

from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.services import Services
from hil_emulator.device.storage import MemoryStorage
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.fast_path_nodes import FastPathNodes

POSITION, PRESSURE, COUNTER, TIME, FORCE = (
    0x20200020, 0x20100010, 0x20400010, 0x20410020, 0x20300020,
)  # fmt: skip
"""Mapping words of objects that a TPDO may carry."""

OFF_FAST_PATH = patch.object(FastPathNodes, "enter", lambda self: None)


def service_names() -> list[str]:
    """Return the names of all services of a node, as `Services` has them."""
    dictionary = Dictionary.from_eds(shipped("eds/hydraulic_actuator.eds"), 5)
    services = Services(dictionary, (), {}, MemoryStorage(), (), lambda: None, lambda: None)
    return list(services.by_name)


def session(script: Script, ticks: int) -> Session:
    """Return the results of a session with the reference machine."""
    return played(ServiceSession(script, ticks), Path())


def played(given: ServiceSession, folder: Path) -> Session:
    """Return the results of a session."""
    results = Session()
    with bench(given.configured(folder)) as b:
        b.ticks(2)
        b.tick(START)
        results.run(b, given.script, given.ticks)
        results.services = dict(b.rig.nodes[0]._services.by_name)
    return results


def compare(script: Script, ticks: int) -> Session:
    """Check that a session has the same results with and without the fast path; return them."""
    fast = session(script, ticks)
    with OFF_FAST_PATH:
        ordinary = session(script, ticks)
    assert fast == ordinary
    assert not ordinary.ticks_on_fast_path
    return fast


@pytest.mark.parametrize("name", service_names())
def test_a_service_acts_the_same_on_and_off_the_fast_path(name: str, tmp_path: Path) -> None:
    """All frames and objects are equal; without the service's declaration they differ.

    A service that declares `NEVER` is not needed on the fast path, so no session depends on it.
    """
    assert name in SESSIONS, (
        f"Services.{name} has no session: add one to SESSIONS in tests/simulation/"
        "service_sessions.py in which it acts while the node is on the fast path, or keeps it off"
    )
    fast = played(SESSIONS[name], tmp_path)
    with OFF_FAST_PATH:
        assert fast == played(SESSIONS[name], tmp_path)
    kind = type(fast.services[name])
    if getattr(kind, "quiet_until_ns", NOW) is NEVER:
        assert fast.ticks_on_fast_path > 20
        return
    with patch.object(kind, "quiet_until_ns", NEVER, create=True):
        assert fast != played(SESSIONS[name], tmp_path), f"the session does not need {kind}"


def test_a_service_without_a_declaration_keeps_its_node_off_the_fast_path() -> None:
    """Any object without the declaration may act at any time."""
    with bench(machine()) as b:
        services = b.rig.nodes[0]._services
        services.added = object()  # type: ignore[attr-defined]
        b.ticks(2)
        b.tick(START)
        b.ticks(10, SYNC)
        assert not b.rig.nodes[0].fast_path.on


def test_a_node_that_only_repeats_itself_is_on_the_fast_path() -> None:
    """Set points, SYNC and four TPDOs in each tick, and heartbeats."""
    results = compare({}, 500)
    assert results.ticks_on_fast_path > 450
    assert {0x185, 0x285, 0x385, 0x485, 0x705} <= {frame.can_id for _, frame in results.frames}


def test_reading_an_object_in_every_tick_shows_every_sample() -> None:
    """By SDO and in the dictionary an object that is read is up to date."""
    asked = (0x2020, 0x2040, 0x2041, 0x2010)
    script = {t: [("frames", read(asked[t % 4])), ("look",)] for t in range(100)}
    compare(script, 120)


@pytest.mark.parametrize(("target", "kind"), FAULTS)
def test_a_fault_acts_the_same_on_and_off_the_fast_path(target: str, kind: str) -> None:
    """Faults of every kind begin and end while the node is on the fast path."""
    results = compare({50: [("fault", target, kind, "60 ms")], 110: [("look",)]}, 200)
    assert results.ticks_on_fast_path >= 50


KINDS = [(0, 0, 0), (1, 0, 0), (3, 0, 0), (252, 0, 0), (253, 0, 0), (254, 0, 0), (255, 0, 0),
         (254, 2, 0), (255, 3, 0), (254, 1, 15), (255, 0, 15)]  # fmt: skip
"""Transmission type, event timer [ms], inhibit time [0.1 ms]."""


@pytest.mark.parametrize(("kind", "timer", "inhibit"), KINDS)
def test_every_transmission_type_is_kept(kind: int, timer: int, inhibit: int) -> None:
    """Synchronous, requested and event-driven TPDOs are sent at the same times."""
    asked: list[Action] = [("frames", Frame(0x285, remote=True))]
    script: Script = {
        20: [("requests", *typed(2, kind, timer, inhibit))], 60: asked,
        61: [("replaced", SYNC, SYNC)],
        62: [SILENT], 63: asked, 90: [("replaced", SYNC)], 91: [SILENT],
    }  # fmt: skip
    compare(script, 150)


def two_nodes() -> tuple[list[Frame], int]:
    """Return the frames of two nodes of a rig, and the number of ticks with both on the fast path.

    One node is remapped and reset. The other produces a heartbeat that the first consumes, and its
    third TPDO is sent on request.
    """
    first = machine().nodes[0]
    second = dataclasses.replace(first, id=6, commands={"valve_current": 0.0})
    events = {
        20: [Frame(0x605, bytes.fromhex("23161001 2c010600"))],  # consumes what node 6 produces
        **{60 + 2 * i: [frame] for i, frame in enumerate(remapped(1, [POSITION, COUNTER]))},
        90: [Frame(0x385 + 1, remote=True)],
        110: [Frame(0x000, bytes([129, 6]))],
        130: [Frame(0x000, bytes([1, 6]))],
        150: [Frame(0x606, bytes.fromhex("2b171000 00000000"))],  # falls silent
    }
    ticks = 0
    with bench(dataclasses.replace(machine(), nodes=(first, second))) as b:
        b.ticks(2)
        b.tick(Frame(0x000, bytes([1, 0])))
        for tick in range(500):
            b.tick(*events.get(tick, ()), SYNC)
            ticks += all(node.fast_path.on for node in b.rig.nodes)
        return b.heard, ticks


def test_each_of_several_nodes_enters_the_fast_path_by_itself() -> None:
    """Remapping a node only moves the other node's part of the record."""
    heard, ticks = two_nodes()
    with OFF_FAST_PATH:
        assert two_nodes() == (heard, 0)
    assert ticks > 250
    assert {0x185, 0x186, 0x286, 0x386, 0x486, 0x706, 0x085} <= {frame.can_id for frame in heard}


def actions() -> Iterator[st.SearchStrategy[Action]]:
    """Yield the possible actions of a session."""
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
    ).map(lambda frames: ("replaced", *frames))
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
def test_events_of_all_kinds_act_the_same_on_and_off_the_fast_path(script: Script) -> None:
    """Actions of all kinds in any order give the same frames and objects."""
    compare(script, 300)
