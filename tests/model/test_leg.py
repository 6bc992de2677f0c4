"""Two joints of a leg: a link that swings about a joint at the end of another."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from reference_machine import STEP, ballistic
from scipy.integrate import solve_ivp

from hil_emulator.model import kernel
from hil_emulator.model.plant import Plant, on_one_supply

G = 9.80665
BASE, CRANK, RETRACTED = 0.322, 0.045, 0.282
MakePlant = Callable[..., Plant]


@dataclass
class Links:
    """Upper and lower leg, by hand: bodies in a plane and cylinders in triangles."""

    mass: tuple[float, float] = (1.9, 0.807)
    centre: tuple[float, float] = (0.16, 0.12)
    inertia: tuple[float, float] = (0.03, 0.01)  # about the centre
    length: float = 0.35
    elevation: tuple[float, float] = (math.radians(-120.0), math.radians(-40.0))
    sense: tuple[float, float] = (1.0, -1.0)
    extra: float = 0.1  # mass at each rod

    def angles(self, x: np.ndarray) -> np.ndarray:
        """Return each link's own angle, from the law of cosines."""
        c = RETRACTED + np.array([x, np.zeros(2)])
        theta = np.arccos((BASE**2 + CRANK**2 - c**2) / (2 * BASE * CRANK))
        return np.array(self.elevation) + np.array(self.sense) * (theta[0] - theta[1])

    def places(self, x: np.ndarray) -> np.ndarray:
        """Return both centres of mass and the links' angles over the horizontal, shape (6,)."""
        upper, lower = self.angles(x)
        lower += upper
        first = self.centre[0] * np.array([np.cos(upper), np.sin(upper)])
        knee = self.length * np.array([np.cos(upper), np.sin(upper)])
        second = knee + self.centre[1] * np.array([np.cos(lower), np.sin(lower)])
        return np.array([*first, *second, upper, lower])

    def mass_matrix(self, x: np.ndarray) -> np.ndarray:
        """Return the kinetic energy's matrix in the rods' coordinates, by differences."""
        h = 1e-6
        columns = [(self.places(x + e) - self.places(x - e)) / (2 * h) for e in h * np.eye(2)]
        j = np.array(columns).T
        weights = np.diag([self.mass[0]] * 2 + [self.mass[1]] * 2 + list(self.inertia))
        return j.T @ weights @ j + self.extra * np.eye(2)

    def potential(self, x: np.ndarray) -> float:
        """Return the energy of height."""
        at = self.places(x)
        return G * (self.mass[0] * at[1] + self.mass[1] * at[3])

    def energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return kinetic and potential energy."""
        return float(0.5 * v @ self.mass_matrix(x) @ v + self.potential(x))

    def accelerations(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Solve Lagrange's equations, d/dt(M v) = force + d(T - V)/dx, by differences."""
        h, lagrangian = 1e-5, np.empty(2)
        turning = np.zeros((2, 2))
        for i, e in enumerate(h * np.eye(2)):
            above, below = self.mass_matrix(x + e), self.mass_matrix(x - e)
            turning += (above - below) / (2 * h) * v[i]
            kinetic = 0.5 * v @ (above - below) @ v
            lagrangian[i] = (kinetic - self.potential(x + e) + self.potential(x - e)) / (2 * h)
        return np.linalg.solve(self.mass_matrix(x), force + lagrangian - turning @ v)

    def values(self) -> tuple[dict[str, float], dict[str, float]]:
        """Return the parameters of hip and knee that describe these links."""
        (m_1, m_2), (c_1, c_2), (j_1, j_2) = self.mass, self.centre, self.inertia
        hip = {
            "rotary_joint_inertia": j_1 + m_1 * c_1**2 + m_2 * self.length**2,
            "rotary_joint_mass_moment": m_1 * c_1 + m_2 * self.length,
            "rotary_joint_link_length": self.length,
        }
        knee = {
            "rotary_joint_inertia": j_2 + m_2 * c_2**2,
            "rotary_joint_mass_moment": m_2 * c_2,
        }
        both = []
        for i, joint in enumerate((hip, knee)):
            angle = {"elevation": self.elevation[i], "sense": self.sense[i]}
            named = {f"rotary_joint_{name}": value for name, value in angle.items()}
            both.append(ballistic(load_mass=self.extra, **joint, **named))
        return both[0], both[1]


def state(plants: list[Plant]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities of both loads."""
    return (
        np.array([float(plant.signals.load_position) for plant in plants]),
        np.array([float(plant.signals.load_velocity) for plant in plants]),
    )


@pytest.mark.slow
def test_a_free_leg_keeps_its_energy(two_actuators: kernel.Kernel) -> None:
    """Nothing but gravity acts on the double pendulum: kinetic and potential energy add up."""
    links = Links()
    plants = on_one_supply(two_actuators, list(links.values()), STEP)
    begin = links.energy(*state(plants))
    swung = []
    for _ in range(150):
        plants[0].step(50)
        x, v = state(plants)
        assert links.energy(x, v) == pytest.approx(begin, abs=1e-6)
        swung.append([*x, 0.5 * v @ links.mass_matrix(x) @ v])
    reach = np.ptp(np.array(swung), axis=0)
    assert reach[:2].min() > 0.005
    assert reach[2] > 0.1


def test_a_leg_follows_lagranges_equations(two_actuators: kernel.Kernel) -> None:
    """Both rods push and pull; scipy integrates Lagrange's equations, differentiated by number."""
    links = Links()
    plants = on_one_supply(two_actuators, list(links.values()), STEP)
    forces = [np.array(f) for f in ((300.0, -60.0), (-200.0, 80.0), (-250.0, -50.0), (200.0, 0.0))]
    z, worst, fastest = np.array([0.04, 0.04, 0.0, 0.0]), 0.0, 0.0
    for force in forces:
        for plant, against in zip(plants, -force, strict=True):
            plant.inputs.external_force = against
        plants[0].step(1500)
        solved = solve_ivp(
            lambda _, z, f=force: [*z[2:], *links.accelerations(z[:2], z[2:], f)],
            (0.0, 0.03), z, rtol=1e-9, atol=1e-12,
        )  # fmt: skip
        z = solved.y[:, -1]
        x, v = state(plants)
        worst = max(worst, *np.abs(x - z[:2]) / 0.08, *np.abs(v - z[2:]))
        fastest = max(fastest, *np.abs(v))
    print(f"worst {worst:.1e} of range, at up to {fastest:.2f} m/s")
    assert fastest > 0.3
    assert worst < 1e-4


def test_a_hanging_leg_swings_at_the_double_pendulums_frequencies(
    two_actuators: kernel.Kernel,
) -> None:
    """Both links hang: omega² are the eigenvalues of M^-1 K in closed form."""
    c, (m_1, m_2), (c_1, c_2) = RETRACTED + 0.04, Links.mass, Links.centre
    turned = math.acos((BASE**2 + CRANK**2 - c**2) / (2 * BASE * CRANK))
    turned -= math.acos((BASE**2 + CRANK**2 - RETRACTED**2) / (2 * BASE * CRANK))
    links = Links(elevation=(-0.5 * math.pi - turned, turned), extra=0.1)
    plants = on_one_supply(two_actuators, list(links.values()), STEP)
    stiffness = np.empty((2, 2))
    for j, plant in enumerate(plants):
        for sign in (1.0, -1.0):
            plant.state.position = 0.04 + sign * 1e-6
            plants[0].step(0)
            pulled = [float(p.signals.acceleration) for p in plants]
            stiffness[:, j] = pulled if sign > 0 else (stiffness[:, j] - pulled) / 2e-6
        plant.state.position = 0.04
    i_1, i_2 = links.inertia[0] + m_1 * c_1**2, links.inertia[1] + m_2 * c_2**2
    h = links.length * m_2 * c_2
    lever = math.sqrt(BASE**2 * CRANK**2 - (0.5 * (BASE**2 + CRANK**2 - c**2)) ** 2) / c
    m = np.array(
        [[i_1 + m_2 * links.length**2 + i_2 + 2 * h, i_2 + h], [i_2 + h, i_2]]
    ) + links.extra * lever**2 * np.eye(2)  # fmt: skip
    low = m_2 * c_2 * G
    k = np.array([[(m_1 * c_1 + m_2 * links.length) * G + low, low], [low, low]])
    expected = np.sort(np.linalg.eigvals(np.linalg.solve(m, k)).real)
    squares = np.sort(np.linalg.eigvals(-stiffness).real)
    print("Hz:", np.sqrt(expected) / (2 * np.pi))
    assert squares == pytest.approx(expected, rel=1e-6)


def test_a_load_cell_that_gives_way_hardly_changes_a_legs_motion(
    two_actuators: kernel.Kernel,
) -> None:
    """The rods move as before; each load cell reads the force that accelerates what is behind."""
    states = []
    for compliance in (0.0, 4e-9):
        both = [
            v | {"coupling_compliance_compliance": compliance, "rod_mass_mass": 0.286}
            for v in Links().values()
        ]
        plants = on_one_supply(two_actuators, both, STEP)
        for plant in plants:
            plant.inputs.external_force = -100.0
        plants[0].step(2000)
        states.append(np.concatenate(state(plants)))
        for plant in plants:
            s = plant.signals
            assert s.load_force == pytest.approx(-0.286 * s.acceleration, abs=2.0)
    np.testing.assert_allclose(states[1], states[0], atol=2e-4)


def test_gravity_of_a_joint_turns_with_it(make_plant: MakePlant) -> None:
    """A free link keeps its energy; held level it weighs m g c over its lever, upright nothing."""
    joint = {"rotary_joint_inertia": 0.05, "rotary_joint_mass_moment": 0.3}
    c = RETRACTED + 0.04
    theta = [math.acos((BASE**2 + CRANK**2 - at**2) / (2 * BASE * CRANK)) for at in (RETRACTED, c)]
    lever = BASE * CRANK * math.sin(theta[1]) / c
    for sense in (1.0, -1.0):
        level = -sense * (theta[1] - theta[0])
        for elevation, expected in ((0.0, sense * 0.3 * G / lever), (0.5 * math.pi, 0.0)):
            plant = make_plant(ballistic(
                rotary_joint_elevation=level + elevation, rotary_joint_sense=sense, **joint
            ))  # fmt: skip
            assert plant.signals.resisting_force == pytest.approx(expected, abs=1e-9)
    plant = make_plant(ballistic(rotary_joint_elevation=-2.0, load_mass=0.1, **joint))
    energies = []
    for _ in range(100):
        plant.step(50)
        at, v = RETRACTED + plant.signals.position, plant.signals.velocity
        angle = math.acos((BASE**2 + CRANK**2 - at**2) / (2 * BASE * CRANK))
        omega = v / (BASE * CRANK * math.sin(angle) / at)
        height = 0.3 * G * math.sin(-2.0 + angle - theta[0])
        energies.append(0.5 * (0.05 * omega**2 + 0.1 * v**2) + height)
    assert np.ptp(energies) < 1e-7
    assert abs(plant.signals.position - 0.04) > 1e-3
