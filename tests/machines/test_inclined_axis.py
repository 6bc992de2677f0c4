"""The worked rig: a proportional axis on its I/O module, with the controller of its page."""

import struct
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import can
import pytest
from test_shown import block

import hil_emulator as hil
from hil_emulator.commands.check import warnings
from hil_emulator.config.load import load_rig
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.stability import required_step
from hil_emulator.platform.packaged import packaged

PAGE = "tutorial/inclined_axis.md"
FILE = packaged()["inclined_axis"]
SCENARIO = packaged()["wire_break_on_a_slope"]


@pytest.fixture(scope="module")
def page() -> Any:
    """Return what the page defines: its controller, and its drive."""
    names: dict[str, Any] = {}
    exec(block(PAGE, "run", "import struct"), names)
    drive = block(PAGE, "run", "import hil_emulator").partition("\n\nmoved =")[0]
    exec(drive, names)
    return SimpleNamespace(**names, names=names)


def test_the_rig_is_the_one_of_its_data_sheets(model: Kernel) -> None:
    """Dead band, solenoid, slope and pump of the page; no warning, and a step that is safe."""
    config = load_rig([FILE])
    plant = config.plant
    assert plant["overlap_lap"] == pytest.approx(0.2 * 1.6)
    assert plant["current_saturation_limit"] == pytest.approx(1.6)
    assert plant["gravity_force"] == pytest.approx(500 * 9.80665 / 2)
    assert plant["fixed_pump_flow"] == pytest.approx(30e-3 / 60)
    assert list(warnings(config)) == []
    assert config.step <= required_step(model, plant)


def test_the_controller_reaches_its_targets(page: Any) -> None:
    """Within 0.3 mm after 0.8 s, up and down; the pump limits the speed to q/A, 0.16 m/s."""
    table = page.drive("inclined_axis", [150.0, 150.0, 60.0, 60.0])
    position, velocity = table["model.position"], table["model.velocity"]
    assert position.iloc[799] == pytest.approx(0.150, abs=3e-4)
    assert position.iloc[1599] == pytest.approx(0.060, abs=3e-4)
    assert velocity.iloc[100:150].mean() == pytest.approx(30e-3 / 60 / 3.117e-3, rel=0.08)


def test_without_crossing_the_dead_band_it_stays_short(page: Any) -> None:
    """A proportional controller hardly moves on where its output, 80 mV/mm, is in the dead band."""
    crossing, page.names["DEAD_BAND"] = page.names["DEAD_BAND"], 0.0
    try:
        table = page.drive("inclined_axis", [150.0, 150.0])
    finally:
        page.names["DEAD_BAND"] = crossing
    assert 0.010 < 0.150 - table["model.position"].iloc[-1] < 2000.0 / 80.0 * 1e-3


def test_the_module_shows_the_plant_in_its_own_scales(page: Any) -> None:
    """4 to 20 mA are 0 to 400 bar, 0 to 10 V are 0 to 200 mm, ±10 V are ±1.6 A of the spool."""
    heard: dict[int, bytes] = {}
    with hil.Rig("inclined_axis") as rig, can.Bus(**rig.bus) as bus:
        for _ in range(20):
            rig.step()
            while message := bus.recv(0.0):
                heard[message.arbitration_id] = bytes(message.data)
        signals = rig.signals
        a, _, supply, position = struct.unpack("<4h", heard[0x289])
        force, spool, *unwired = struct.unpack("<4h", heard[0x389])
        assert a == pytest.approx(4000 + 16000 * signals.pressure_a / 400e5, abs=25)
        assert supply == pytest.approx(4000 + 16000 * signals.supply_pressure / 400e5, abs=25)
        assert position == pytest.approx(1e4 * signals.position / 0.2, abs=2)
        assert force == pytest.approx(signals.load_force / 10.0, abs=15)
        assert spool == pytest.approx(1e4 * signals.spool_position / 1.6, abs=2)
        assert unwired == [0, 0]


def test_the_controller_passes_the_scenario_of_a_broken_wire(
    page: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All expectations of the packaged scenario, played as the page plays it."""
    monkeypatch.chdir(SCENARIO.parent)
    names = {**page.names}
    exec(block(PAGE, "run", "def connect"), names)
    assert [c.text for c in names["outcome"].checks if not c.passed] == []
    assert len(names["outcome"].checks) == 7
    (module,) = [c for c in names["outcome"].checks if "0x6401:1" in c.text]
    assert "-100 bar ... -10 bar" in module.text  # 0 and 3600 digits of 1 uA, 4 mA are 0 bar
    assert module.observed == "-100 bar ... -100 bar"


def test_a_controller_that_does_not_look_at_the_current_fails_it(page: Any) -> None:
    """It goes on with the enable, and the scenario fails."""

    class Blind(page.PositionController):
        def answer(self, position: float) -> None:
            self.tripped = False
            super().answer(position)

    def connect(rig: Any) -> Callable[[], None]:
        bus = can.Bus(**rig.bus)
        rig.every_tick(Blind(bus, 150.0).step)
        return bus.shutdown

    (outcome,) = hil.play(SCENARIO, connect)
    missed = [check.text for check in outcome.checks if not check.passed]
    assert len(missed) >= 2
    assert any("RPDO1" in text for text in missed)


def test_a_broken_wire_ends_the_motion(page: Any) -> None:
    """Below 3.6 mA the controller takes the enable away within 4 ms, and the valve closes."""
    with hil.Rig("inclined_axis") as rig, can.Bus(**rig.bus) as bus:
        controller = page.PositionController(bus, 150.0)
        pass_ticks(rig, controller.step, 200)
        assert rig.signals.model.velocity > 0.1
        rig.fault("pressure_a", "wire_break")
        pass_ticks(rig, controller.step, 5)
        assert controller.tripped
        assert rig.signals.valve_current == 0.0
        pass_ticks(rig, controller.step, 300)
        stopped = rig.signals.model.position
        assert stopped < 0.149
        pass_ticks(rig, controller.step, 200)
        assert rig.signals.model.position == pytest.approx(stopped, abs=2e-4)


def pass_ticks(rig: Any, step: Callable[[], None], count: int) -> None:
    """Let time pass with the controller."""
    for _ in range(count):
        rig.step()
        step()


@pytest.mark.slow
def test_friction_of_the_guides_is_found_in_the_logs_of_the_rig(page: Any) -> None:
    """800 N are hidden; of all effects the page's search names this one alone, within 3 %."""
    names = {**page.names}
    exec(block(PAGE, "run", "axis = hil.load"), names)
    exec(block(PAGE, "run", "answer ="), names)
    missing = names["answer"].missing
    assert list(missing) == ["load_coulomb_friction"]
    assert missing["load_coulomb_friction"].value == pytest.approx(800.0, rel=0.03)


@pytest.mark.slow
def test_nothing_is_found_in_the_logs_of_the_rig_as_described(page: Any) -> None:
    """The same search on logs without hidden friction."""
    names = {**page.names}
    logs = block(PAGE, "run", "axis = hil.load").replace('"800 N"', '"0 N"')
    exec(logs + block(PAGE, "run", "answer ="), names)
    assert names["answer"].verdict == "nothing_missing"
