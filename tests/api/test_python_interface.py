"""What `import hil_emulator as hil` offers."""

import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pandas as pd
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.optimize import brentq
from scipy.signal import lsim

import hil_emulator as hil
from hil_emulator.api.environment import Reaching
from hil_emulator.commands.linear import linearised
from hil_emulator.config.load import load_whole
from hil_emulator.platform.packaged import packaged
from hil_emulator.recording import journal

EFFECT = ("internal_leakage", "2 cm^3/(min*bar)")


@pytest.fixture(scope="module")
def knee() -> hil.Actuator:
    """Return the reference machine."""
    return hil.load("hyq_knee")


def test_the_names_are_few_and_cost_nothing_until_they_are_used() -> None:
    """An import alone brings neither numpy nor numba nor pandas; the stub has the same names."""
    code = "import sys, hil_emulator as hil; print(*sys.modules); print(*hil.__all__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded, names = (line.split() for line in done.stdout.splitlines())
    assert not {"numpy", "numba", "pandas", "can", "pydantic"} & set(loaded)
    assert len(names) <= 25
    stub = Path(hil.__file__).with_suffix(".pyi").read_text()
    assert all(f'"{name}"' in stub and getattr(hil, name) for name in names)


def test_a_function_with_the_name_of_a_subpackage_can_be_called() -> None:
    """`identify` and `machines` are callable after the subpackages were imported, too."""
    code = """
import hil_emulator.identify.session as session
import hil_emulator.machines.sizing
import hil_emulator as hil
assert hil.identify.session is session
assert "hyq_knee" in hil.machines()
try:
    hil.identify("hyq_knee")
except hil.UserError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "at least one log" in done.stdout


def test_the_rod_moves_as_fast_as_the_orifice_equation_says(knee: hil.Actuator) -> None:
    """Its speed at 0.5 mA, by its sensor, is that of the data sheets alone, within 0.5 %.

    q = K_v i sqrt(drop) at each edge, K_v from 7.5 l/min at 10 mA and 35 bar; q_b = alpha q_a;
    A (p_a - alpha p_b) = 1500 N s/m v + 100 N. The closed form's edges have no clearance.
    """
    area, alpha, opening = 2.0106e-4, 0.61, 0.5e-3 * 7.5e-3 / 60 / 10e-3 / 35e5**0.5

    def unbalanced(speed: float) -> float:
        pressure_a = 160e5 - (area * speed / opening) ** 2
        pressure_b = 1e5 + (alpha * area * speed / opening) ** 2
        return area * (pressure_a - alpha * pressure_b) - 1500.0 * speed - 100.0

    table = knee.with_effect("land_leakage", "0 A").simulate("0.5 mA", "400 ms").loc[0.15:]
    speed = np.polyfit(table.index, table["position"], 1)[0]
    assert speed == pytest.approx(brentq(unbalanced, 0.0, 1.0), rel=5e-3)


@pytest.mark.slow
def test_a_small_step_is_what_the_linear_model_says(knee: hil.Actuator) -> None:
    """The response to a step of 10 uA at rest agrees with the exact linear model within 3 %.

    Without dry friction, which is not linear in so small a motion, and after a settling time.
    """
    smooth = knee.with_layer('[friction]\ncoulomb_friction = "0 N"\n').with_effect(*EFFECT)
    exact = smooth.linearise().exact
    settled, more = 0.3, 10e-6
    still = smooth.simulate(exact.current, "400 ms")
    moved = smooth.simulate(lambda t: exact.current + more * (t >= settled - 1e-9), "400 ms")
    velocity = (moved - still)["model.velocity"].loc[settled - 1e-9 :].to_numpy()
    row, column = exact.outputs.index("velocity"), exact.inputs.index("valve_current")
    system = (exact.a, exact.b[:, [column]], exact.c[[row]], exact.d[[row]][:, [column]])
    time = np.linspace(0.0, 0.1, 1001)
    _, linear, _ = lsim(system, np.full(len(time), more), time)
    wanted = linear[10 : 10 * len(velocity) + 1 : 10]  # a row holds the end of its tick
    assert np.max(np.abs(velocity - wanted)) < 0.03 * np.max(np.abs(wanted))


@pytest.mark.slow
def test_inputs_follow_quantities_arrays_and_functions(knee: hil.Actuator) -> None:
    """Three ways to state the same current give the same table, which states its units."""
    table = knee.simulate("1 mA", "20 ms")
    assert table.equals(knee.simulate(np.full(20, 1e-3)))
    assert table.equals(knee.simulate(lambda time: 1e-3, 0.02))
    assert table.attrs["units"]["pressure_a"] == "Pa"
    pushed = knee.simulate("1 mA", "20 ms", external_force="2 kN")
    assert pushed["model.position"].iloc[-1] < table["model.position"].iloc[-1]
    assert hil.to_xarray(table)["position"].attrs["units"] == "m"


@pytest.mark.slow
def test_an_effect_changes_another_actuator(knee: hil.Actuator) -> None:
    """The effect is on in what is returned, and off in what it was asked of."""
    leaky = knee.with_effect(*EFFECT)
    assert leaky.effects["internal_leakage"] == "2 cm^3/(min*bar)"
    assert "internal_leakage" not in knee.effects
    off_by = knee.with_effect("offset", "2 bar", channel="pressure_a")
    apart = off_by.simulate(0.0, 0.005)["pressure_a"] - knee.simulate(0.0, 0.005)["pressure_a"]
    assert np.allclose(apart, 2e5, atol=6.1e3)  # a step of the sensor's resolution


@pytest.mark.parametrize(
    ("call", "remedy"),
    [
        (lambda k: k.with_effect("internal_leak"), "did you mean 'internal_leakage'?"),
        (lambda k: k.with_effect("offset", "1 bar"), "name its channel"),
        (lambda k: k.with_effect("internal_leakage", "3 bar"), "with_effect"),
        (lambda k: k.simulate("1 mA"), "duration is missing"),
        (lambda k: k.simulate("1 bar", "1 s"), "valve_current"),
        (lambda k: k.simulate(0.0, "1 s", load="3 N"), "the plant has no input 'load'"),
        (lambda k: k.linearise(position="3 m"), "outside the stroke"),
        (lambda k: hil.load("hyq_leg"), 'actuator="hip" or actuator="knee"'),
        (lambda k: hil.load("hyq_kne"), "hyq_knee"),
        (lambda k: hil.load(), "hyq_knee"),
        (lambda k: hil.read("run.csv"), "run.csv"),
        (lambda k: hil.Rig("force_balance"), "describes"),
        (lambda k: hil.gap(k), "at least one log"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_remedy(knee: hil.Actuator, call: object, remedy: str) -> None:
    """Every mistake is one `UserError` in words."""
    with pytest.raises(hil.UserError) as error:
        call(knee)  # type: ignore[operator]
    assert remedy in str(error.value)


def test_a_rig_in_lock_step_obeys_the_controller_of_its_loop(
    knee: hil.Actuator, tmp_path: Path
) -> None:
    """A proportional controller brings the rod to its target, and what happened can be read."""
    with hil.Rig(knee) as rig:
        position = rig.signals.position
        while rig.now < 0.6:
            position = rig.step(0.1 * (0.05 - position)).position
        assert abs(position - 0.05) < 1e-3
        table = rig.table()
        journal.write(rig.recording(), tmp_path / "run.rec")
    again = hil.read(tmp_path / "run.rec")
    assert again.equals(table)
    assert again.attrs["units"] == table.attrs["units"]


@pytest.mark.slow
def test_a_linear_model_shows_itself(knee: hil.Actuator) -> None:
    """It is the command's, with a picture and a table for a notebook."""
    model = knee.linearise(position="30 mm", current="1 mA")
    config = load_whole([packaged()["hyq_knee"]])
    assert model.coefficients == linearised(config, 0.03, 1e-3).coefficients
    assert model.plot().png.startswith(b"\x89PNG")
    assert "<table>" in model._repr_html_()


@pytest.mark.slow
def test_a_table_with_units_is_as_good_as_its_file(tmp_path: Path) -> None:
    """`gap` measures the same of a log, of the table read from it, and of one in other units."""
    rig = packaged()["friction_rig"]
    log = rig.parent / "oring_1bar.csv"
    table = hil.read(log)
    there = table.attrs["units"]
    assert there["position"] == "m"
    bare = pd.DataFrame({f"{n} [{there[n]}]": table[n] for n in ("position", "pressure_a",
                                                                 "load_force")})  # fmt: skip
    machine = hil.load("friction_rig")
    results = [hil.gap(machine, source) for source in (log, table, bare)]
    assert results[0].verdict == "disagrees"
    assert [f.result.gap for f in results] == [results[0].result.gap] * 3
    assert results[0].plot().png.startswith(b"\x89PNG")
    assert "disagrees" in results[0]._repr_html_()
    results[0].save(tmp_path)
    assert (tmp_path / "result.json").is_file()


def test_the_environment_keeps_the_rules_of_gymnasium() -> None:
    """Gymnasium's own checker passes it, and a seed gives the same episode again."""
    check_env(Reaching(), skip_render_check=True)
    episodes = []
    for _ in range(2):
        env = gymnasium.wrappers.TimeLimit(Reaching(), 3)
        first, _ = env.reset(seed=7)
        episodes.append([first, *(env.step(np.array([0.5], np.float32))[0] for _ in range(3))])
    assert np.array_equal(*episodes)


def test_gymnasium_finds_it_by_name() -> None:
    """In a new process: by the name that imports it, and by the plain name after the import."""
    names = ("hil_emulator.learning:hil_emulator/Knee-v0", "hil_emulator/Knee-v0")
    code = f"import gymnasium; print(*[gymnasium.make(name).spec.id for name in {names}])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["hil_emulator/Knee-v0"] * 2


def test_a_typical_effect_of_a_sensor_is_a_part_of_its_span(knee: hil.Actuator) -> None:
    """Without a value it has the typical one, which the catalogue states in spans of a channel."""
    assert knee.with_effect("offset", channel="load_force").effects["load_force.offset"] == "50 N"
    with pytest.raises(hil.UserError, match="no channel 'force', did you mean 'load_force'"):
        knee.with_effect("offset", channel="force")
