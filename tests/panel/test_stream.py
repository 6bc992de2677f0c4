"""The panel of a running emulator, as a page meets it."""

import asyncio
import http.client
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from hil_emulator.recording import journal
from tests.panel.bench import PATIENCE_S, Bench, Page, running, visit


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where the emulator runs."""
    return tmp_path_factory.mktemp("panel")


@pytest.fixture(scope="module")
def bench(folder: Path) -> Iterator[Bench]:
    """Yield an emulator under the wall clock."""
    with running("--panel", folder=folder) as started:
        yield started


def status_of(bench: Bench, path: str, **headers: str) -> int:
    """Return the status of a plain request."""
    client = http.client.HTTPConnection("127.0.0.1", bench.port)
    client.request("GET", path, headers=headers)
    status = client.getresponse().status
    client.close()
    return status


@pytest.mark.parametrize("token", ["", "wrong", "%00", "é"])
def test_the_stream_opens_to_the_token_alone(bench: Bench, token: str) -> None:
    """Whoever has not the printed address gets nothing of the bench."""

    async def knock() -> None:
        async with bench.stream(token):
            pass

    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(knock())
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize("origin", ["http://evil.test", "null", "https://127.0.0.1"])
def test_a_page_of_another_origin_is_refused(bench: Bench, origin: str) -> None:
    """Even one that knows the token."""

    async def knock() -> None:
        async with bench.stream(origin=origin):
            pass

    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(knock())
    assert refused.value.response.status_code == 403


def test_a_foreign_name_for_this_machine_is_refused(bench: Bench) -> None:
    """A name that a foreign server lets point here (DNS rebinding) opens not even the page."""
    assert status_of(bench, "/") == 200
    assert status_of(bench, "/", Host=f"evil.test:{bench.port}") == 403
    assert status_of(bench, "/../serve.py") == 404


def test_a_strip_shows_what_the_bench_does(bench: Bench) -> None:
    """The position that the buckets carry is that of the rod at rest in mid-stroke."""

    async def look(page: Page) -> Any:
        hello = (await page.word(lambda m: "hello" in m))["hello"]
        assert hello["mode"] == "live"
        names = [column["name"] for column in hello["columns"]]
        await page.send(do="view", columns="model.position", span=10, pixels=500, generation=7)
        message = await page.until(lambda m: isinstance(m, bytes) and m[8] == 7)
        count = struct.unpack_from("<I", message, 4)[0]
        numbers = np.frombuffer(message[48:], np.float32)
        return numbers[names.index("model.position")], numbers[len(names) :].reshape(2, count)

    now, (low, high) = visit(bench, look)
    assert now == pytest.approx(0.04, abs=0.01)
    assert (low <= high).all()
    assert low[-1] == pytest.approx(0.04, abs=0.01)


def test_a_fault_goes_in_and_out(bench: Bench) -> None:
    """It is listed with the time it has left, its emergency appears in words, and it ends."""

    async def act(page: Page) -> None:
        done = await page.ask(do="fault", target="pressure_a", kind="off", duration="1000 s")
        message = await page.word(lambda m: m.get("status", {}).get("faults"))
        assert 900.0 < message["status"]["faults"][0]["left"] <= 1000.0
        await page.send(do="watch", what="nodes")
        message = await page.word(lambda m: m.get("nodes") and m["nodes"][0]["emergency"])
        assert message["nodes"][0]["emergency"]["words"].startswith("0xFF10 sensor out of range")
        assert await page.ask(do="end", number=done["number"])
        await page.word(lambda m: "status" in m and not m["status"]["faults"])
        refused = await page.ask(do="fault", target="supply", kind="droop", drop="900 bar")
        assert refused["error"] == "fault supply droop: drop: 900 bar is outside 0 bar ... 400 bar"

    visit(bench, act)


def test_nmt_and_sdo_by_hand(bench: Bench) -> None:
    """A node starts, returns its name, accepts a heartbeat time and refuses writes to constants."""

    async def act(page: Page) -> None:
        assert "error" not in await page.ask(do="nmt", command="start", node=5)
        await page.word(
            lambda m: m.get("status", {}).get("nodes") == [{"id": 5, "state": "operational"}]
        )
        read = await page.ask(do="sdo", node=5, index="0x1008", subindex="0")
        assert read["text"] == "Manufacturer device name = Hydraulic actuator emulator"
        written = await page.ask(do="sdo", node=5, index="0x1017", subindex="0", value="50")
        assert written["text"] == "Producer heartbeat time written"
        await page.send(do="watch", what="trace", filter="heartbeat")
        beat = "heartbeat node 5  operational"
        await page.word(lambda m: m.get("trace") and m["trace"][-1]["words"] == beat)
        refused = await page.ask(do="sdo", node=5, index="0x1008", subindex="0", value="other")
        assert refused["error"].startswith("SDO: Code 0x06010002")

    visit(bench, act)


def test_a_set_point_moves_the_rod_and_one_out_of_bounds_is_refused(bench: Bench) -> None:
    """As through the remote control, with the same words."""

    async def act(page: Page) -> None:
        await page.ask(do="nmt", command="start", node=5)
        await page.ask(do="set", valve_current="0.5 mA")
        await page.word(lambda m: m.get("status", {}).get("settings", {}).get("valve_current"))
        refused = await page.ask(do="set", valve_current="20 A")
        assert refused["error"] == "valve_current: 20 A is outside -10000 mA ... 10000 mA"
        await page.ask(do="set", valve_current="0 mA")

    visit(bench, act)


def test_a_recording_from_the_panel_is_one(bench: Bench, folder: Path) -> None:
    """It has every tick between its ends, its marker, and no file that is there is lost."""

    async def act(page: Page) -> None:
        assert "error" not in await page.ask(do="record", file="panel.rec")
        await page.word(lambda m: m.get("status", {}).get("recording") == "panel.rec")
        await page.ask(do="marker", text="here")
        await page.ask(do="record")
        assert (
            "exists already; choose another name"
            in (await page.ask(do="record", file="panel.rec"))["error"]
        )
        assert "without a folder" in (await page.ask(do="record", file="../x.rec"))["error"]

    visit(bench, act)
    journal_file = journal.read(folder / "panel.rec")
    assert len(journal_file.rows) > 10
    assert np.allclose(np.diff(journal_file.table()["time"]), 1e-3)
    assert [what for _, what in journal_file.events if "marker" in what] == [{"marker": "here"}]


def test_a_scenario_meets_its_expectations_one_by_one(bench: Bench) -> None:
    """They are open first, and met at the end, as in `hil-emulator scenario`."""

    def states(m: dict[str, Any]) -> list[str]:
        scenario = m.get("status", {}).get("scenario") or {"checks": []}
        return [check["state"] for check in scenario["checks"]]

    async def act(page: Page) -> None:
        assert "error" not in await page.ask(do="play", name="stuck_spool_at_speed")
        first = await page.word(lambda m: states(m))
        assert "open" in states(first)
        await page.word(lambda m: set(states(m)) == {"met"})
        assert "no scenario" in (await page.ask(do="play", name="../../etc/passwd"))["error"]

    visit(bench, act)


@pytest.mark.slow
def test_the_end_of_the_emulator_is_told_and_a_second_one_has_a_port_of_its_own(
    bench: Bench,
) -> None:
    """The stream is closed with a code of its own, also when it was killed."""
    with running("--panel-view-only", "--duration", "8 s") as second:
        assert second.port != bench.port

        async def watch(page: Page) -> None:
            assert (await page.word(lambda m: "hello" in m))["hello"]["mode"] == "view"
            for request in ({"do": "set", "external_force": "1 N"}, {"do": "record"}):
                assert "only shows" in (await page.ask(**request))["error"]
            second.process.terminate()
            with pytest.raises(ConnectionClosed) as closed:
                await page.until(lambda m: False)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4001
            assert second.process.wait(PATIENCE_S) == 0

        visit(second, watch)


@pytest.mark.slow
def test_the_timing_of_the_loop_is_told(bench: Bench) -> None:
    """How long its ticks took in the last seconds: half of them, nearly all, the longest."""

    async def act(page: Page) -> Any:
        await page.send(do="watch", what="loop")
        return (await page.word(lambda m: "loop" in m))["loop"]

    timing = visit(bench, act)
    p50, p99, longest = timing["execution"]
    assert 0.0 < p50 <= p99 <= longest
    assert math.isfinite(longest)
