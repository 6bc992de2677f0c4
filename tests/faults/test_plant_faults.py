"""Plant and electrical faults as a controller sees them: in pressures, motion and force."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rigs import START, Bench, bench, reference, set_point
from runs import BEGIN, END, Run, codes, run, sound, values

from hil_emulator.errors import UserError


@pytest.fixture
def b() -> Iterator[Bench]:
    """Yield a bench whose node is OPERATIONAL."""
    with bench(reference()) as made:
        made.ticks(5)
        made.tick(START)
        yield made


CASES: list[tuple[str, str, dict[str, Any]]] = [
    ("supply", "loss", {}),
    ("supply", "droop", {}),
    ("cylinder", "leak", {}),
    ("cylinder", "friction_jump", {}),
    ("oil", "air", {}),
    ("valve", "stuck", {}),
    ("valve", "clogged", {}),
    ("valve", "slow", {}),
]


@pytest.mark.parametrize(("target", "kind", "options"), CASES)
def test_the_controller_sees_it_and_its_end_restores_every_parameter(
    b: Bench, target: str, kind: str, options: dict[str, Any]
) -> None:
    """Pressures or motion differ from those of the sound rig; afterwards no parameter does."""
    before = b.rig.plant.parameter_vector.copy()
    with b.rig.fault(target, kind, **options):
        b.ticks(10, set_point(1.0))
        assert (b.rig.plant.parameter_vector != before).sum() == 1
    assert b.rig.plant.parameter_vector.tobytes() == before.tobytes()
    heard = run(target, kind, **options)
    assert heard[:BEGIN] == sound()[:BEGIN]
    changed = [values(heard, c) != values(sound(), c) for c in ("pressure_a", "pressure_b")]
    assert any(changed)


def speed(b: Bench, milliampere: float, ticks: int = 100) -> float:
    """Return the speed of the rod at a current, from its PDO [m/s]."""

    def position() -> float:
        (frame,) = [f for f in b.tick(set_point(milliampere)) if f.can_id == 0x285]
        return int.from_bytes(frame.data[:4], "little", signed=True) * 1e-7

    b.ticks(20, set_point(milliampere))
    start = position()
    b.ticks(ticks, set_point(milliampere))
    return (position() - start) / (ticks * 1e-3)


def test_a_lost_supply_stops_the_rod(b: Bench) -> None:
    """The supply sensor falls to 1 bar and the current that moved the rod out no longer does."""
    assert speed(b, 0.5) > 0.02
    with b.rig.fault("supply", "loss"):
        assert speed(b, 0.5) < 0.002
        assert b.rig.value("supply_pressure") == pytest.approx(1e5, abs=1e5)
    b.ticks(5, set_point(0.5))
    assert b.rig.value("supply_pressure") == pytest.approx(160e5, abs=1e5)


def test_a_droop_shows_in_the_supply_pressure() -> None:
    """40 bar less during the fault, 0 bar less afterwards."""
    heard = run("supply", "droop", drop="40 bar")
    assert np.mean(values(heard, "supply_pressure")) == pytest.approx(120e5, abs=1e5)
    assert np.mean(values(heard, "supply_pressure", END, 300)) == pytest.approx(160e5, abs=1e5)


def test_a_leak_brings_the_chambers_together(b: Bench) -> None:
    """With the valve at rest, the difference of the chamber pressures shrinks."""

    def difference() -> float:
        b.ticks(100, set_point(0.0))
        return abs(b.rig.value("pressure_a") - b.rig.value("pressure_b"))

    before = difference()
    with b.rig.fault("cylinder", "leak"):
        assert difference() < 0.7 * before


def test_a_friction_jump_takes_pressure_to_move(b: Bench) -> None:
    """At the same current the load pressure rises by 500 N over the piston's area."""

    def hydraulic_force() -> float:
        speed(b, 0.5, 50)
        return 2.0106e-4 * (b.rig.value("pressure_a") - 0.61 * b.rig.value("pressure_b"))

    before = hydraulic_force()
    with b.rig.fault("cylinder", "friction_jump", force="500 N"):
        assert hydraulic_force() - before == pytest.approx(500.0, rel=0.2)


def test_air_makes_the_pressures_slow() -> None:
    """After a step of the current, pressure a rises less in the first milliseconds."""

    def rise(fraction: str) -> float:
        with bench(reference()) as b, b.rig.fault("oil", "air", fraction=fraction):
            b.ticks(300)
            b.tick(START)
            start = b.rig.value("pressure_a")
            b.ticks(2, set_point(3.0))
            return b.rig.value("pressure_a") - start

    assert rise("20 %") < 0.8 * rise("0 %")


def test_a_stuck_spool_ignores_the_set_point(b: Bench) -> None:
    """Stuck open, the rod moves on although the current is 0; freed, it stops."""
    speed(b, 0.5)
    with b.rig.fault("valve", "stuck"):
        assert speed(b, 0.0, 50) > 0.02
    assert abs(speed(b, 0.0, 50)) < 0.01


def test_a_clogged_valve_moves_the_rod_slower(b: Bench) -> None:
    """With half the flow the rod has about half the speed."""
    before = speed(b, 0.5)
    with b.rig.fault("valve", "clogged", share="50 %"):
        assert 0.3 * before < speed(b, 0.5) < 0.7 * before


def test_a_slow_spool_answers_late(b: Bench) -> None:
    """5 mm of the stroke are reached later than with a sound spool."""

    def reached() -> float:
        start = b.rig.value("position")
        b.ticks(30, set_point(2.0))
        travel = b.rig.value("position") - start
        b.ticks(60, set_point(-1.0))
        return travel

    before = reached()
    with b.rig.fault("valve", "slow"):
        assert reached() < 0.7 * before


@pytest.mark.parametrize(("target", "kind"), [("coil", "open"), ("coil", "short")])
def test_without_current_the_rod_stays(b: Bench, target: str, kind: str) -> None:
    """The set point arrives, the current does not; afterwards it does again."""
    with b.rig.fault(target, kind):
        assert abs(speed(b, 0.5)) < 0.01
        assert b.rig.plant.inputs.valve_current == 0.0
    assert speed(b, 0.5) > 0.02
    assert b.rig.plant.inputs.valve_current == 5e-4


def test_a_short_circuit_is_reported_a_broken_wire_is_not() -> None:
    """EMCY 0x2320 and its end; nothing for the open coil."""
    assert codes(run("coil", "short")) == [0x2320, 0x0000]
    assert codes(run("coil", "open")) == []


@pytest.mark.slow
def test_shut_off_valves_that_close_hold_the_rod() -> None:
    """The rod moves with its valve, stays where it is while the lines are shut, and goes on."""
    valves = {"shut_off_valves_closing_time": 0.02}
    config = reference()
    with bench(dataclasses.replace(config, plant=config.plant | valves)) as b:
        b.ticks(5)
        b.tick(START)
        assert speed(b, 0.5, 50) > 0.02
        with b.rig.fault("lines", "shut"):
            b.ticks(50, set_point(0.5))
            assert abs(speed(b, 0.5, 50)) < 1e-4
        assert speed(b, 0.5, 50) > 0.02
        b.rig.set("lines_closed", 1.0)
        b.ticks(50, set_point(0.5))
        assert abs(speed(b, 0.5, 50)) < 1e-4


def test_what_is_not_there_cannot_be_shut(b: Bench) -> None:
    """Without shut-off valves, both the fault and the setting are refused."""
    with pytest.raises(UserError, match=r"no shut_off_valves; .* \[lines\]"):
        b.rig.fault("lines", "shut")
    with pytest.raises(UserError, match="no shut_off_valves"):
        b.rig.set("lines_closed", 1.0)


def test_a_weak_driver_limits_the_speed(b: Bench) -> None:
    """Beyond 0.2 mA more current makes nothing faster."""
    with b.rig.fault("coil", "current_limited", limit="0.2 mA"):
        slow = speed(b, 0.2, 50)
        assert speed(b, 0.5, 50) == pytest.approx(slow, rel=0.1)
    assert speed(b, 0.5, 50) > 1.5 * slow


def test_an_electrical_fault_leaves_the_frames_of_the_past_alone() -> None:
    """Until it begins every frame is that of the sound rig."""
    heard: Run = run("coil", "current_limited", limit="0.1 mA")
    assert heard[:BEGIN] == sound()[:BEGIN]
    assert heard[END - 1] != sound()[END - 1]


def test_a_setting_changed_during_a_fault_holds_after_it(b: Bench) -> None:
    """The supply is set to 100 bar while it is lost; when it returns, it is 100 bar."""
    with b.rig.fault("supply", "loss"):
        b.rig.set("supply_pressure", 100e5)
        b.ticks(5)
        assert b.rig.plant.parameters.supply_pressure == 1e5
    assert b.rig.plant.parameters.supply_pressure == 100e5


def test_overlapping_faults_end_in_any_order(b: Bench) -> None:
    """A droop within a droop: each takes its own part back."""
    first = b.rig.fault("supply", "droop", drop="40 bar")
    b.ticks(2)
    second = b.rig.fault("supply", "droop", drop="20 bar")
    b.ticks(2)
    assert b.rig.plant.parameters.supply_pressure == pytest.approx(100e5)
    first.end()
    b.ticks(2)
    assert b.rig.plant.parameters.supply_pressure == pytest.approx(140e5)
    second.end()
    b.ticks(2)
    assert b.rig.plant.parameters.supply_pressure == 160e5
