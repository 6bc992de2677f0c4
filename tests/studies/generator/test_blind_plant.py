"""The blind plant has the declared laws, and other laws where it declares them.

The reference is the model of the package: with the same parameters both must move alike.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hil_emulator.config.load import load
from hil_emulator.identify.measured.between_rows import CONTROLLER
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.plant import Plant
from tests.identify.rig_data import CACHE, knee_model
from tests.studies.generator.bench import SetPoint
from tests.studies.generator.benches import AXIS, BENCHES, CRANE, FIRST, Bench
from tests.studies.generator.cases import GROUPS, SPREAD, case, cases, machine
from tests.studies.generator.effects import EFFECTS, OUTSIDE, SITS, size_on
from tests.studies.generator.laws import CONSTANT, GASSY, STIFFENS
from tests.studies.generator.plant import STEP, VACUUM, Machine, advance, at_rest, pressure, rates
from tests.studies.generator.sensors import CHANNELS, late, noise, ringing

IN_PLANT = [key for key in EFFECTS if "." not in key]
READ = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
CURRENT = 1e-3 * np.repeat([0.0, 1.0, -2.5, 2.5, 0.15, -0.15, -1.0, 3.0, -3.0], 60)
"""Steps small and large, in both senses [A]."""


CONFIGURED = {bench.name: load([bench.config]) for bench in BENCHES.values()}
ON_ALL = pytest.mark.parametrize("bench", [FIRST, AXIS, CRANE], ids=["knee", "axis", "crane"])


def blind(effects: dict[str, float], foreign: bool, bench: Bench = FIRST) -> np.ndarray:
    """Return the channels of the blind plant without any drift or noise."""
    real = Machine(**bench.sheet, ripple=0.0, foreign=foreign,
                   **{k: v for k, v in effects.items() if k in Machine._fields})  # fmt: skip
    acts = SetPoint(effects.get("transport_delay", 0.0), foreign, bench.period)
    s, memory = at_rest(real)
    rows = []
    for k, u in enumerate(CURRENT):
        now = k * bench.period
        for set_point, steps in acts(u):
            force = advance(real, s, memory, set_point, real.supply, now, steps)
            now += steps * STEP
        rows.append([s[2], s[3], real.supply + s[7], s[4], force])
    return np.array(rows) / bench.noise


@cache
def modelled(bench: Bench) -> PlantModel:
    """Return the package's model of a bench's data sheet."""
    return PlantModel(CONFIGURED[bench.name], CACHE)


def of_the_package(effects: dict[str, float], bench: Bench = FIRST) -> np.ndarray:
    """Return the same of the package's model."""
    model = modelled(bench)
    values = dict(model.plant_values) | {"load_spring_rest_position": bench.middle}
    for key, size in effects.items():
        effect = next(e for e in CATALOGUE if e.name == EFFECTS[key].name)
        values[effect.field_of(effect.knob)] = EFFECTS[key].knob(size)
    values["valve_gain"] = bench.sheet["kv"]
    plant = Plant(model.kernel, values, 2e-5)
    start, _ = at_rest(Machine(**bench.sheet, ripple=0.0, foreign=False))
    plant.set_pressures(start[2] + effects.get("gravity", 0.0) / bench.sheet["area"], start[3])
    at = [model.signal_names.index(n) for n in READ]
    rows = []
    for u in CURRENT:
        for _ in range(round(bench.period / CONTROLLER)):
            plant.command({"valve_current": u})
            plant.step(round(CONTROLLER / 2e-5))
        rows.append(plant.signal_vector[at])
    return np.array(rows) / bench.noise


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Return the root mean square difference in standard deviations of the noise."""
    return float(np.sqrt(np.mean((a - b) ** 2)))


@ON_ALL
def test_both_plants_are_the_same_machine(bench: Bench) -> None:
    """Two integrators, two frictions, two orifices: within the sensors' noise."""
    assert apart(blind({}, False, bench), of_the_package({}, bench)) < 1.0


@ON_ALL
@pytest.mark.parametrize("key", IN_PLANT)
def test_the_first_law_is_the_catalogues(key: str, bench: Bench) -> None:
    """An effect changes both plants alike, and much less alike by its foreign law."""
    effects = {key: 2.0 * EFFECTS[key].medium * size_on(key, bench.over(FIRST))}
    changed = of_the_package(effects, bench) - of_the_package({}, bench)
    plain = blind({}, False, bench)
    alike = apart(blind(effects, False, bench) - plain, changed)
    foreign = apart(blind(effects, True, bench) - plain, changed)
    size = apart(changed, np.zeros_like(changed))
    assert alike < 0.15 * size
    # a crane's sensors hardly distinguish several plays from one loop
    assert foreign > (1.0 if (key, bench) == ("hysteresis", CRANE) else 1.5) * alike


def test_a_late_channel_is_late_by_its_time_in_both_laws() -> None:
    """A slow ramp comes late by the same time through a dead time and through three lags."""
    ramp = np.arange(400) * 1e-3
    for foreign in (False, True):
        assert (ramp - late(ramp, 1.5e-3, 1e-3, foreign))[-1] == pytest.approx(1.5e-3, rel=1e-3)


@pytest.mark.parametrize("period", [1e-3, 2e-3])
def test_lags_of_a_device_do_not_depend_on_the_number_of_calls(period: float) -> None:
    """A set point that steps comes as 1 - exp(-x)(1 + x + x^2/2), x = t/lag, between ticks as well.

    A ramp is read late by their sum, less exp(-x)(3 + 2x + x^2/2) lags of what has not settled.
    """
    lag = 0.5e-3
    acts = SetPoint(3.0 * lag, True, period)
    parts = [part for _ in range(3) for part in acts(1.0)]
    ends = np.cumsum([steps for _, steps in parts]) * STEP
    x = (ends - 0.5 * ends[0]) / lag
    np.testing.assert_allclose(
        [acting for acting, _ in parts], 1.0 - np.exp(-x) * (1.0 + x + 0.5 * x**2), atol=1e-9
    )
    ramp = np.arange(8) * period
    x = ramp / lag
    behind = lag * (3.0 - np.exp(-x) * (3.0 + 2.0 * x + 0.5 * x**2))
    np.testing.assert_allclose(ramp - late(ramp, 3.0 * lag, period, True), behind, atol=1e-9)


def test_a_ringing_line_passes_what_is_slow() -> None:
    """A step arrives in full, after an overshoot that a tenth of critical damping gives."""
    step = np.where(np.arange(600) < 10, 0.0, 1.0)
    read = ringing(step, 1.2e-3, 1e-3)
    assert read[-1] == pytest.approx(1.0, abs=1e-3)
    assert 1.7 < read.max() < 1.8


def test_coloured_noise_has_the_power_of_white_noise() -> None:
    """Half of it is slow, so that successive samples are alike."""
    drawn = noise(20000, True, np.random.default_rng(3))
    assert np.std(drawn) == pytest.approx(1.0, rel=0.05)
    assert np.corrcoef(drawn[1:, 0], drawn[:-1, 0])[0, 1] == pytest.approx(0.475, abs=0.03)


def test_what_is_hidden_can_be_named_and_what_is_outside_cannot() -> None:
    """Every effect of the plant has its name among the candidates, or else a place in a balance."""
    candidates_of_knee = {c.name for c in candidates(knee_model(), CHANNELS)}
    assert {hidden.name for hidden in EFFECTS.values()} <= candidates_of_knee
    assert not set(OUTSIDE) & candidates_of_knee
    assert set(SITS) == set(OUTSIDE)


def test_the_study_has_every_effect_in_every_kind_of_question() -> None:
    """At least 200 cases and 20 effects; outside effects are in no catalogue."""
    whole = list(cases(GROUPS))
    assert len(whole) >= 200
    assert len(EFFECTS) >= 20
    for group in ("medium", "small", "tiny", "foreign", "pairs"):
        assert {k for c in whole if c.group == group for k in c.effects} == set(EFFECTS)
    assert {k for c in whole if c.group == "outside" for k in c.effects} == set(OUTSIDE)
    assert all(
        len(c.effects) == n
        for c in whole
        for n in [{"pairs": 2, "triples": 3, "foreign-pairs": 2, "none": 0}.get(c.group, 1)]
    )


def test_a_third_of_the_cases_is_dirty_and_a_tenth_far_off() -> None:
    """Ordinary parameters stay within half of the data sheet's value, most within one sigma."""
    whole = list(cases(GROUPS))
    assert 0.28 < np.mean([c.dirty for c in whole]) < 0.38
    assert 0.07 < np.mean([c.wide for c in whole]) < 0.13
    for c in whole:
        real, reach = machine(c), 4.0 if c.wide else 1.05
        for name, sigma in SPREAD.items():
            off = abs(getattr(real, name) / FIRST.sheet[name] - 1.0)
            assert off <= min(0.5, reach * sigma) + 1e-9


def test_a_case_is_drawn_from_its_name_alone() -> None:
    """Whatever else is asked, the case with a name is the same one."""
    assert case("pairs", 4) == next(c for c in cases({"none": 2, "pairs": 9}) if
                                    c.name == "pairs-04")  # fmt: skip
    assert replace(case("small", 3), duration=2.0) == case("small", 3, 2.0)


def test_a_case_of_another_bench_is_another_case() -> None:
    """Its name contains its bench; the effect is the same, as large for that machine."""
    here, there = case("medium", 10), case("medium", 10, bench=AXIS)
    assert (there.group, there.bench) == ("medium", AXIS)
    assert there.name != here.name
    assert list(there.effects) == list(here.effects) == ["stribeck"]
    pushes = [b.sheet["area"] * b.sheet["supply"] for b in (FIRST, AXIS)]
    share = [e.effects["stribeck"] / push for e, push in zip((here, there), pushes, strict=True)]
    assert 0.8 / 1.25 < share[1] / share[0] < 1.25 / 0.8


@pytest.mark.parametrize("oil", [GASSY, CONSTANT, STIFFENS], ids=["gassy", "constant", "stiffens"])
def test_a_void_takes_as_much_oil_to_fill_as_it_took_to_open(oil: int) -> None:
    """A closed chamber whose rod moves out and back has its pressure again, after a void too."""
    real = Machine(**FIRST.sheet, ripple=0.0, foreign=False)._replace(oil_form=oil, clearance=1e-12)
    rest, rate = at_rest(real)[0], np.zeros(11)

    def per_way(position: float, oil_in_a: np.ndarray) -> float:
        state = rest.copy()
        state[2], state[4], state[5] = oil_in_a[0], position, 1.0
        rates(real, state, 0.0, real.supply, 0.0, rate)
        return float(rate[2])

    def moved(start: float, end: float, oil_in_a: float) -> float:
        way = solve_ivp(per_way, (start, end), [oil_in_a], rtol=1e-9, atol=1e-3)
        return float(way.y[0, -1])

    out = moved(rest[4], rest[4] + 2e-3, rest[2])
    assert pressure(out) == VACUUM
    assert moved(rest[4] + 2e-3, rest[4], out) == pytest.approx(rest[2], rel=1e-4)
