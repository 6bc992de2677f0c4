"""FMUs for model exchange: closed forms, events, and faulty ones."""

import math
import struct
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.fmi.importing.wiring import wire
from hil_emulator.frame import Frame
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator
from tests.fmi.slides import slide

pytest.importorskip("fmpy")

KNEE = shipped("configs/hyq_knee.toml")
FULL = pytest.mark.full(sibling="test_one_that_fails_does_not_take_the_bus_down")
FORCE, PUSH, ONSET, REACH, REBOUND = 2e3, 1e3, 0.0123456, 15.0, 0.5

BOTH = 'ModelExchange modelIdentifier="slide"/><CoSimulation'

WIRED = f"""
[plant]
fmu = "slide.fmu"
timeout = "500 ms"
[plant.inputs]
valve_current = "u"
[plant.outputs]
position = "x"
velocity = "v"
acceleration = "a"
[plant.parameters]
force = {FORCE}
push = {PUSH}
onset = {ONSET}
reach = {REACH}
rebound = {REBOUND}
"""


@pytest.fixture(scope="session", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def sliding(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile the slide for both versions of FMI."""
    return slide(request.param, tmp_path_factory.mktemp("slide") / "slide.fmu")


@contextmanager
def emulator(fmu: Path, text: str) -> Iterator[Emulator]:
    """Run the reference machine with a layer on top, in lock-step."""
    layer = fmu.parent / "layer.toml"
    layer.write_text(text)
    with Emulator(load([KNEE, layer])) as made:
        yield made


def driven(made: Emulator, ticks: int) -> list[Frame]:
    """Command 5 mA from the second tick on, and return what the node has sent."""
    with Bus(made.bus) as peer:
        made.tick()
        peer.send([Frame(0x000, bytes([1, 5]))])
        heard: list[Frame] = []
        for _ in range(ticks):
            peer.send([Frame(0x205, struct.pack("<i", 5_000_000))])
            made.tick()
            heard += peer.receive()
        return heard


def course(time: float) -> tuple[float, float]:
    """Return place [m] and velocity [m/s] at a time: pushed from 1 ms, more from ONSET, bounced."""
    first, second = 5.0 * FORCE, 5.0 * FORCE + PUSH
    speed = first * (ONSET - 1e-3)
    place = 0.5 * first * (ONSET - 1e-3) ** 2
    impact = math.sqrt(speed**2 + 2.0 * second * (REACH - place))
    since = time - ONSET - (impact - speed) / second
    assert 0.0 < since < 2.0 * REBOUND * impact / second
    place = REACH - REBOUND * impact * since + 0.5 * second * since**2
    return 1e-3 * place, 1e-3 * (second * since - REBOUND * impact)


def test_it_moves_by_the_closed_form_through_both_kinds_of_events(sliding: Path) -> None:
    """A step of force between two integration steps, then a bounce: to 1e-9, in its units."""
    with emulator(sliding, WIRED) as made:
        driven(made, 69)
        place, speed = course(70e-3)
        assert made.signals.model.position == pytest.approx(place, rel=1e-9)
        assert made.signals.model.velocity == pytest.approx(speed, rel=1e-9)
        assert made.signals.model.acceleration == pytest.approx(11.0, rel=1e-12)


def test_a_request_after_a_step_is_an_event(sliding: Path) -> None:
    """Its further force sets in at the end of the step that passes 19.99 ms: at 20 ms."""
    text = WIRED.replace(f"onset = {ONSET}", "onset = 1e9").replace("reach = 15.0", "reach = 1e9")
    with emulator(sliding, f"{text}misdeed = 11\n") as made:
        driven(made, 29)
        speed = 1e-3 * (5.0 * FORCE * 29e-3 + PUSH * 10e-3)
        assert made.signals.model.velocity == pytest.approx(speed, rel=1e-9)


def test_an_event_that_is_due_at_the_end_of_a_tick_acts_in_it(sliding: Path) -> None:
    """The further force sets in at 20 ms, and is in the acceleration of 20 ms."""
    text = WIRED.replace(f"onset = {ONSET}", "onset = 0.02")
    with emulator(sliding, text) as made:
        driven(made, 18)
        assert made.signals.model.acceleration == pytest.approx(5e-3 * FORCE, rel=1e-12)
        made.tick()
        assert made.signals.model.acceleration == pytest.approx(
            1e-3 * (5.0 * FORCE + PUSH), rel=1e-12
        )


@pytest.mark.parametrize(
    ("misdeed", "message"),
    [
        (2, "has crashed: signal 11"),
        (9, "finds no end of its events at 0.05 s"),
        pytest.param(3, "its integration from 0.0", marks=FULL),
        pytest.param(4, "discarded", marks=FULL),
        pytest.param(5, "has not answered for 0.5 s", marks=FULL),
        pytest.param(6, "has ended with exit code 7", marks=FULL),
        pytest.param(7, "has a state that is no finite number", marks=FULL),
        pytest.param(8, "has ended its simulation at 0.0", marks=FULL),
        pytest.param(10, "has over 100 events within 2e-05 s", marks=FULL),
        pytest.param(13, "an event indicator that is no number", marks=FULL),
    ],
)
def test_one_that_fails_does_not_take_the_bus_down(
    tmp_path: Path, unpacked: Path, misdeed: int, message: str
) -> None:
    """The node sends one emergency 0x6100, no plausible reading, and responds; no file is left."""
    fmu = slide(3, tmp_path / "slide.fmu")
    # an event is due while the misdeed is done
    text = WIRED.replace(f"onset = {ONSET}", "onset = 0.05").replace("reach = 15.0", "reach = 1e9")
    with emulator(fmu, f"{text}misdeed = {misdeed}\n") as made:
        sent = driven(made, 80)
        assert message in made.rig.plant.supply.failure
        assert [f.data[:2] for f in sent if f.can_id == 0x085 and f.data[:2] != bytes(2)] == [
            b"\x00\x61"
        ]
        last = [f for f in sent if f.can_id == 0x385][-1]
        assert struct.unpack_from("<i", last.data)[0] == -(2**31)
    assert not list(unpacked.iterdir())


@pytest.mark.parametrize(
    ("misdeed", "message"),
    [
        (8, "has ended its simulation at 0.051 s"),
        (12, "its step from 0.05 s ended early"),
    ],
)
def test_a_communication_step_that_is_no_whole_one_is_a_failure(
    tmp_path: Path, misdeed: int, message: str
) -> None:
    """The results that FMI 3.0 returns besides the status are evaluated."""
    fmu = slide(3, tmp_path / "slide.fmu", interface="CoSimulation")
    with emulator(fmu, f"{WIRED}misdeed = {misdeed}\n") as made:
        driven(made, 60)
        assert message in made.rig.plant.supply.failure


def test_an_array_is_refused_by_name(tmp_path: Path) -> None:
    """One number is wired to one signal."""
    given, fmu = slide(3, tmp_path / "given.fmu"), tmp_path / "slide.fmu"
    with zipfile.ZipFile(given) as before, zipfile.ZipFile(fmu, "w") as after:
        for name in before.namelist():
            text = before.read(name)
            whole = (
                b'name="x" valueReference="2" causality="output" variability="continuous" unit="mm"'
            )
            after.writestr(
                name, text.replace(whole + b"/>", whole + b'><Dimension start="3"/></Float64>')
            )
    layer = tmp_path / "layer.toml"
    layer.write_text(WIRED)
    settings = load([KNEE, layer]).fmu
    assert settings is not None
    with pytest.raises(UserError, match="'x' is an array"):
        wire(settings)


@pytest.mark.parametrize(
    ("there", "wanted", "used"),
    [
        ("CoSimulation", None, "co-simulation"),
        ("ModelExchange", None, "model exchange"),
        (BOTH, None, "co-simulation"),
        (BOTH, "model exchange", None),
        ("CoSimulation", "model exchange", "has co-simulation, no model exchange"),
        ("ScheduledExecution", None, "has neither co-simulation nor model exchange"),
    ],
)
def test_co_simulation_is_used_unless_another_interface_is_wanted(
    tmp_path: Path, there: str, wanted: str | None, used: str | None
) -> None:
    """An interface that the FMU lacks is refused before the run; the message names its own."""
    slide(3, tmp_path / "slide.fmu", interface=there)
    asked = f'interface = "{wanted}"\n[plant.inputs]' if wanted else "[plant.inputs]"
    layer = tmp_path / "layer.toml"
    layer.write_text(WIRED.replace("[plant.inputs]", asked))
    settings = load([KNEE, layer]).fmu
    assert settings is not None
    if used and used.startswith("has"):
        with pytest.raises(UserError, match=used):
            wire(settings)
    else:
        assert wire(settings).interface == (used or wanted)
