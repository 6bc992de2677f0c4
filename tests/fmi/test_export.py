"""The exported FMU, checked and run by FMPy."""

import math
import zipfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.commands.export_fmu import actuator_of
from hil_emulator.config.load import load
from hil_emulator.fmi.exporting.archive import contents
from hil_emulator.fmi.exporting.variables import variables
from hil_emulator.model.kernel import build
from hil_emulator.model.plant import Plant
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.simulation.active_effects import acting
from hil_emulator.simulation.assembly import compiled
from tests.fmi.instance import Run

fmpy = pytest.importorskip("fmpy")

KNEE = shipped("configs/hyq_knee.toml")
TICK = 1e-3


def test_fmpy_finds_nothing_wrong(knee_fmu: Path) -> None:
    """Schema, names, model structure, start values, units: FMPy's whole validation."""
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(knee_fmu)) == []


def test_it_moves_as_the_built_in_plant(run: Run) -> None:
    """Every signal within 1e-9 of its range, under other parameters and moving inputs."""
    config = acting(load([KNEE]))
    plant = Plant(
        compiled(config.effects, cache_folder()), config.plant | {"load_mass": 70.0}, 2e-5
    )
    run.begin(load__mass=70.0)
    names = plant.kernel.signals.names or ()
    ours, theirs = [], []
    for tick in range(300):
        current, force = 2e-3 * math.sin(tick * 0.03), 400.0 * math.cos(tick * 0.05)
        plant.command({"valve_current": current, "external_force": force})
        plant.step(50)
        run.set(valve_current=current, external_force=force)
        run.fmu.doStep(tick * TICK, TICK)
        ours.append(plant.signal_vector.copy())
        theirs.append(run.get(*(f"model.{name}" for name in names)))
    apart = np.abs(np.subtract(ours, theirs)).max(axis=0)
    assert np.all(apart <= 1e-9 * (np.ptp(ours, axis=0) + 1e-9 * np.abs(ours).max(axis=0)))


def test_steps_of_any_width_end_in_the_same_place(run: Run) -> None:
    """A tick is never lost or taken twice, whatever the communication step."""
    ends = []
    for width, count in ((1e-3, 60), (3e-3, 20), (0.4e-3, 150), (0.06, 1)):
        run.fmu.reset()
        run.begin()
        run.set(valve_current=1e-3)
        for step in range(count):
            run.fmu.doStep(step * width, width)
        ends.append(run.get("model.position", "model.pressure_a"))
    assert all(end == ends[0] for end in ends)


def test_a_state_can_be_kept_and_turned_to_bytes(run: Run) -> None:
    """A copy of the state and its bytes lead to the same trajectory."""
    run.begin()
    run.set(valve_current=1e-3)
    run.fmu.doStep(0.0, 0.02)
    three = run.three
    state = (run.fmu.getFMUState if three else run.fmu.getFMUstate)()
    content = (run.fmu.serializeFMUState if three else run.fmu.serializeFMUstate)(state)
    futures = []
    again = (run.fmu.deserializeFMUState if three else run.fmu.deSerializeFMUstate)(content)
    for kept in (state, again):
        (run.fmu.setFMUState if three else run.fmu.setFMUstate)(kept)
        run.fmu.doStep(0.02, 0.03)
        futures.append(run.get("model.position", "model.load_force", "position"))
    assert futures[0] == futures[1]
    for kept in (state, again):
        (run.fmu.freeFMUState if three else run.fmu.freeFMUstate)(kept)


def test_an_output_cannot_be_set_and_a_lost_state_is_an_error(run: Run) -> None:
    """Both end in an error of FMI, not in a wrong number."""
    run.begin()
    with pytest.raises(fmpy.fmi1.FMICallException):
        run.set(model__position=0.1)
    run.set(external_force=math.inf)
    with pytest.raises(fmpy.fmi1.FMICallException):
        run.fmu.doStep(0.0, 0.01)


def test_another_tools_token_makes_no_instance(knee_fmu: Path, tmp_path: Path) -> None:
    """A library with another token than its description makes no instance."""
    description = fmpy.read_model_description(str(knee_fmu))
    description.guid = description.instantiationToken = "{another}"
    with pytest.raises(Exception, match="nstantiate"):
        fmpy.instantiate_fmu(
            fmpy.extract(str(knee_fmu), str(tmp_path)), description, "CoSimulation"
        )


def test_every_number_of_the_declarations_is_there() -> None:
    """Unit, bounds and meaning of a knob come from its declaration; bar is offered for Pa."""
    text = contents(actuator_of(load([KNEE]), "Knee 1"), 2)["modelDescription.xml"]
    assert 'modelIdentifier="knee_1"' in text
    assert 'name="friction.coulomb_friction.force"' in text
    assert '<DisplayUnit name="bar" factor="1e-05" offset="0.0" />' in text
    assert '<DisplayUnit name="degC" factor="1.0" offset="-273.15" />' in text
    assert 'description="set point of the coil current" causality="input"' in text


def test_what_is_made_twice_is_the_same_twice(tmp_path: Path) -> None:
    """Header and source depend on the configuration alone."""
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        words = ["export-fmu", str(KNEE), "--c-only", "--float32", "--out"]
        done = CliRunner().invoke(main, [*words, str(tmp_path / folder / "knee")])
        assert done.exit_code == 0, done.output
    for name in ("knee.h", "knee.c"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([str(KNEE), "--float32"], "--c-only"),
        ([str(shipped("configs/hyq_leg.toml"))], "several actuators"),
        ([str(KNEE), "--out", "/nowhere/knee.fmu"], "the folder /nowhere does not exist"),
    ],
)
def test_a_configuration_that_cannot_be_exported_is_refused(words: list[str], message: str) -> None:
    """One message, exit code 2."""
    done = CliRunner().invoke(main, ["export-fmu", *words])
    assert done.exit_code == 2
    assert message in str(done.output) + str(done.exception)


@pytest.mark.slow
def test_the_windows_library_exports_the_interface(tmp_path: Path) -> None:
    """It is not run here; but it is a PE file whose exports name the interface."""
    file = tmp_path / "knee.fmu"
    done = CliRunner().invoke(main, ["export-fmu", str(KNEE), "--out", str(file)])
    assert done.exit_code == 0, done.output
    with zipfile.ZipFile(file) as archive:
        libraries = [n for n in archive.namelist() if n.endswith(".dll")]
        if not libraries:
            pytest.skip("no ziglang")
        binary = archive.read(libraries[0])
    assert binary[:2] == b"MZ"
    assert b"DoStep\0" in binary


def test_bounds_of_a_solenoids_currents_hold_its_values(tmp_path: Path) -> None:
    """Of 1.6 A: 64 mA of hysteresis within 0 and 0.32 A, and every start within its bounds."""
    file = tmp_path / "solenoid.toml"
    file.write_text(
        '[valve]\nnominal_flow = "40 l/min"\nrated_current = "1.6 A"\nhysteresis = "4 %"\n'
        'pressure_drop_per_edge = "5 bar"\ncurrent_saturation = "100 %"\n'
        'spool_rate_limit = "500 A/s"\n',
        encoding="utf-8",
    )
    actuator = actuator_of(load([KNEE, file]), "solenoid")
    rows = variables(actuator, build(actuator.effects, compiled=False))
    (width,) = (v for v in rows if v.name == "valve.hysteresis.width")
    assert (width.low, width.start, width.high) == pytest.approx((0.0, 0.064, 0.32))
    for v in rows:
        if v.start is not None:
            assert v.low <= v.start <= v.high, v.name
