"""Several actuators on one pump, relief valve, accumulator and pair of lines."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from printed_equations import RANGES, Machine
from reference_machine import STEP, machine
from scipy.integrate import solve_ivp

from hil_emulator.model import kernel
from hil_emulator.model.plant import Plant, on_one_supply

FIVE_LITRES = 5e-3 / 60.0
PUMP = {
    "fixed_pump_flow": FIVE_LITRES, "fixed_pump_override": 10e5, "supply_volume": 1e-4,
    "accumulator_gas_volume": 4e-5, "accumulator_precharge": 100e5, "accumulator_exponent": 1.4,
}  # fmt: skip
LINES = {"supply_line_length": 2.0, "back_pressure_resistance": 3.2e13}
TICK = 5e-3
CHANNELS = ("spool_position", "spool_speed", "pressure_a", "pressure_b", "position", "velocity")


MakePlant = Callable[..., Plant]
Supplied = Callable[..., list[Plant]]


@pytest.fixture
def supplied(two_actuators: kernel.Kernel) -> Supplied:
    """Return a function that puts two of the reference machine's actuators on one supply."""

    def supplied(second: Mapping[str, float] = {}, **changes: float) -> list[Plant]:
        first = machine(**(PUMP | changes))
        return on_one_supply(two_actuators, [first, first | dict(second)], STEP)

    return supplied


def state_in(plant: Plant, other: Plant) -> list[float]:
    """Return those of a plant's states that another one has."""
    return [float(plant.state[name]) for name in other.kernel.state.names or ()]


class CommonSupply:
    """Two actuators and their supply once more, by hand: twelve states and the pump's pressure."""

    def __init__(self, first: Machine, second: Machine) -> None:
        self.machines = (first, second)
        self.p_set = first.p_s

    def rates(self, z: np.ndarray, currents: tuple[float, float]) -> list[float]:
        """Continuity at the pump (S1 3.2) with what both valves draw from it."""
        p = z[14]
        drawn, rates = 0.0, []
        for i, m in enumerate(self.machines):
            m.p_s = p
            y = z[7 * i : 7 * i + 7]
            plus, minus = max(0.0, y[0] + m.u_0), max(0.0, -y[0] + m.u_0)
            drawn += m.k_v * (m.flow(plus, p - y[2]) + m.flow(minus, p - y[3]))
            rates += m.rates(y, currents[i])
        relieved = FIVE_LITRES * max(0.0, 1.0 + (p - self.p_set) / 10e5)
        gas = 4e-5 * (100e5 / p) ** (1 / 1.4) / (1.4 * p) if p > 100e5 else 0.0
        return [*rates, (FIVE_LITRES - relieved - drawn) / (1e-4 / 1.3e9 + gas)]

    def after(self, currents: list[tuple[float, float]]) -> np.ndarray:
        """Integrate with LSODA at rtol 1e-10; return the state after each tick, shape (n, 15)."""
        scale = np.array([1e-2, 10.0, 1e7, 1e7, 0.1, 1.0, 1.0] * 2 + [1e7])
        z = np.array([*self.machines[0].start(), *self.machines[1].start(), self.p_set]) / scale
        rows = []
        for both in currents:
            solved = solve_ivp(
                lambda _, z, both=both: np.array(self.rates(z * scale, both)) / scale,
                (0.0, TICK), z, method="LSODA", rtol=1e-10, atol=1e-12, t_eval=[TICK],
            )  # fmt: skip
            assert solved.success, solved.message
            z = solved.y[:, -1]
            rows.append(z * scale)
        return np.array(rows)


@pytest.mark.slow
def test_two_actuators_and_their_supply_are_exact_to_a_ten_thousandth_of_the_range(
    supplied: Supplied,
) -> None:
    """Both move, draw more than the pump gives, and follow LSODA on all equations at once."""
    currents = [(6e-3, 8e-3)] * 8 + [(4e-3, -6e-3)] * 6 + [(-3e-3, 0.0)] * 6
    expected = CommonSupply(Machine(), Machine(m=120.0)).after(currents)
    plants = supplied({"load_mass": 120.0})
    worst, lowest = 0.0, np.inf
    for both, exact in zip(currents, expected, strict=True):
        for plant, current in zip(plants, both, strict=True):
            plant.inputs.valve_current = current
        plants[0].step(round(TICK / STEP))
        for i, plant in enumerate(plants):
            state = np.array([plant.signals[name] for name in CHANNELS])
            supply = float(plant.signals.supply_pressure)
            errors = np.abs(state - exact[7 * i : 7 * i + 6]) / RANGES[:6]
            worst = max(worst, *errors, abs(supply - exact[14]) / 160e5)
            lowest = min(lowest, supply)
    print(f"worst {worst:.1e} of range, supply down to {lowest / 1e5:.0f} bar")
    assert lowest < 140e5
    assert worst < 1e-4


def test_no_oil_is_lost_between_actuators_and_pump(supplied: Supplied) -> None:
    """What the pump's node gains is what pump and relief valve leave of it, less what all draw."""
    first, second = plants = supplied()
    random = np.random.default_rng(1)
    for _ in range(50):
        pump = random.uniform(-90e5, 20e5)
        for plant in plants:
            plant.state.spool_position = random.uniform(-0.01, 0.01)
            plant.state.pressure_a, plant.state.pressure_b = random.uniform(1e5, 160e5, 2)
            plant.state.pump_pressure = pump
        first.step(0)
        supply, slopes = first.supply, np.zeros_like(first.supply.states)
        first.kernel.rate(supply.states, slopes, supply.parameters, supply.inputs, supply.signals)
        rates = slopes.view(first.kernel.state)["pump_pressure"]
        y = first.signals
        p = 160e5 + pump
        gas = 4e-5 * (100e5 / p) ** (1 / 1.4) / (1.4 * p) if p > 100e5 else 0.0
        drawn = y.supply_flow + second.signals.supply_flow
        left = y.pump_flow - y.relief_flow - drawn
        assert rates[0] == rates[1]
        assert rates[0] * (1e-4 / 1.3e9 + gas) == pytest.approx(left, abs=1e-15)


def test_all_actuators_see_the_same_supply(supplied: Supplied) -> None:
    """Whatever each does, the copies of the supply's states agree to the last bit, lines too."""
    plants = supplied(**LINES)
    names = plants[0].kernel.state.names or ()
    shared = [n for n in names if n.startswith(("pump_", "supply_line_", "back_pressure_"))]
    assert len(shared) == 4
    for tick in range(200):
        plants[0].inputs.valve_current = 5e-3 * np.sin(tick)
        plants[1].inputs.valve_current = 8e-3 * np.cos(0.3 * tick)
        assert plants[0].step(50)
        first, second = ([plant.state[n] for n in shared] for plant in plants)
        assert first == second
        assert plants[0].signals.tank_pressure == plants[1].signals.tank_pressure
    assert first != [0.0] * 4


def test_equal_actuators_do_the_same_on_one_supply(
    supplied: Supplied, make_plant: MakePlant
) -> None:
    """The same set point moves them alike to the last bit, and half a supply moves one so."""
    plants = supplied()
    half = {
        n: 0.5 * PUMP[n] for n in ("fixed_pump_flow", "supply_volume", "accumulator_gas_volume")
    }
    alone = make_plant(machine(**(PUMP | half)))
    for plant in (*plants, alone):
        plant.inputs.valve_current = 6e-3
    plants[0].step(2000)
    alone.step(2000)
    first, second = (plant.state_vector.tolist() for plant in plants)
    assert first == second
    assert first == pytest.approx(state_in(alone, plants[0]), rel=1e-9, abs=1e-12)


def test_one_actuator_alone_on_a_shared_supply_is_one_with_its_own(
    supplied: Supplied, make_plant: MakePlant
) -> None:
    """As long as the other one's closed valve draws nothing, to the last bit."""
    moving, resting = supplied(**LINES)
    alone = make_plant(machine(**PUMP, **LINES))
    for plant in (moving, alone):
        plant.inputs.valve_current = 6e-3
        plant.step(2000)
    assert resting.signals.supply_flow == 0.0
    assert moving.state_vector.tolist() == state_in(alone, moving)
    assert resting.signals.supply_pressure == moving.signals.supply_pressure < 158e5


def test_supply_droops_by_what_both_draw(supplied: Supplied) -> None:
    """A relief valve that leaves less to flow closes by its override's share of it (S1 3.2)."""
    plants = supplied(
        accumulator_gas_volume=0.0, cylinder_dead_volume_a=1.0, cylinder_dead_volume_b=1.0,
        load_mass=1e5,
    )  # fmt: skip
    for plant in plants:
        plant.inputs.valve_current = 5e-4
    plants[0].step(20_000)
    drawn = sum(float(plant.signals.supply_flow) for plant in plants)
    expected = 160e5 - 10e5 * drawn / FIVE_LITRES
    assert drawn > 0.2 * FIVE_LITRES
    for plant in plants:
        assert plant.signals.supply_pressure == pytest.approx(expected, rel=1e-4)


def test_each_set_point_arrives_after_its_own_dead_time(supplied: Supplied) -> None:
    """Two valves of one supply: the lag of each driver shows when its current changed."""
    lag, late, end = 1e-3, (0.37e-3, 1.613e-3), 4e-3
    plants = supplied(
        {"transport_delay_time": late[1]},
        transport_delay_time=late[0], driver_lag_time_constant=lag,
    )  # fmt: skip
    plants[0].step(50)
    for plant in plants:
        plant.command({"valve_current": 1e-3})
    for _ in range(round(end / (50 * STEP))):
        plants[0].step(50)
    for plant, dead in zip(plants, late, strict=True):
        reached = 1e-3 * (1.0 - np.exp(-(end - dead) / lag))
        assert plant.signals.valve_current == pytest.approx(reached, rel=1e-6)
