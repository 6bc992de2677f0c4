"""The actuator once more, by hand from the printed equations: numpy and scipy only.

An independent witness: nothing here comes from the package. State, shape (7,):
u_v [A], du_v/dt [A/s], p_a [Pa], p_b [Pa], x [m], v [m/s], bend of the seals [1].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

BAR = 1e5
RANGES = np.array([0.01, np.inf, 160 * BAR, 160 * BAR, 0.08, 1.0, np.inf])
"""Range of each state, to which errors relate; spool speed and bend are no channels."""


@dataclass
class Machine:
    """Numbers of the HyQ knee cylinder, SI."""

    p_s: float = 160 * BAR
    p_t: float = 1 * BAR
    k_v: float = 6.68e-6
    w_v: float = 2 * np.pi * 250.0
    d_v: float = 0.7
    rate: float = 3.6
    i_max: float = 0.01
    delta: float = 1 * BAR
    re_c: float = 14.7
    slot: float = 0.025
    nu: float = 46e-6
    rho: float = 850.0
    u_0: float = 0.0
    a_p: float = 2.0106e-4
    alpha: float = 0.61
    l_c: float = 0.08
    v_pl: float = 3e-6
    beta: float = 1.3e9
    r_air: float = 0.001
    kappa: float = 1.4
    b: float = 1000.0
    f_c: float = 100.0
    f_s: float = 0.0
    c_s: float = 0.02
    v_t: float = 1e-3
    d: float = 2e-5
    m: float = 50.0
    b_l: float = 500.0
    k_stop: float = 1e8
    c_stop: float = 2.0
    force: float = 0.0
    x_0: float = 0.04

    def flow(self, u: float, dp: float) -> float:
        """Flow over K_v through an edge: S1 eq. 3.6, laminar below a Reynolds number or delta."""
        if u == 0.0:
            return 0.0
        diameter = 2 * self.slot * u
        laminar = self.rho / 2 * (self.re_c * self.nu / (0.6 * diameter)) ** 2
        return u * dp / (dp**2 + laminar**2 + self.delta**2) ** 0.25

    def modulus(self, p: float) -> float:
        """S2 eq. 1, corrected."""
        if self.r_air == 0.0:
            return self.beta
        p = max(p, 1e-3)  # only for trial values of the solver
        w = self.r_air * (101_325.0 / p) ** (1 / self.kappa)
        return self.beta * (1 + w) / (1 + w * self.beta / (self.kappa * p))

    def flows(self, u: float, p_a: float, p_b: float) -> tuple[float, float]:
        """S1 eq. 3.9, 3.10 with an opening u_0 of every edge at null."""
        plus, minus = max(0.0, u + self.u_0), max(0.0, -u + self.u_0)
        q_a = self.flow(plus, self.p_s - p_a) - self.flow(minus, p_a - self.p_t)
        q_b = self.flow(plus, p_b - self.p_t) - self.flow(minus, self.p_s - p_b)
        return self.k_v * q_a, self.k_v * q_b

    def friction(self, v: float, z: float) -> float:
        """S1 eq. 3.18; sign(v) from bristles that are springs up to 2 d and slide at 3 d."""
        dry = self.f_c + self.f_s * np.exp(-abs(v) / self.c_s)
        return self.b * v + dry * np.tanh(z + v / self.v_t)

    def stop(self, x: float, v: float) -> float:
        """Hunt-Crossley contact at both ends."""
        if x < 0.0:
            return max(0.0, -self.k_stop * x * (1 - self.c_stop * v))
        if x > self.l_c:
            return -max(0.0, self.k_stop * (x - self.l_c) * (1 + self.c_stop * v))
        return 0.0

    def rates(self, y: np.ndarray, current: float) -> list[float]:
        """Right-hand side: S1 eq. 3.4, 3.9-3.19 and Newton's law."""
        u, du, p_a, p_b, x, v, z = y
        command = np.clip(current, -self.i_max, self.i_max)
        q_a, q_b = self.flows(u, max(p_a, 0.0), max(p_b, 0.0))
        v_a = self.v_pl + self.a_p * x
        v_b = self.v_pl + self.alpha * self.a_p * (self.l_c - x)
        f_h = self.a_p * (max(p_a, 0.0) - self.alpha * max(p_b, 0.0))
        push = f_h - self.friction(v, z) + self.stop(x, v) - self.b_l * v - self.force
        return [
            np.clip(du, -self.rate, self.rate),
            self.w_v**2 * (command - u) - 2 * self.d_v * self.w_v * du,
            self.modulus(p_a) / v_a * (q_a - self.a_p * v),
            self.modulus(p_b) / v_b * (-q_b + self.alpha * self.a_p * v),
            v,
            push / self.m,
            v / max(self.d, abs(v) / 5e4) * min(1.0, 3.0 - z * np.sign(v)),
        ]

    def load_force(self, y: np.ndarray) -> float:
        """S1 eq. 3.19, and what the stop carries."""
        _, _, p_a, p_b, x, v, z = y
        return self.a_p * (p_a - self.alpha * p_b) - self.friction(v, z) + self.stop(x, v)

    def start(self) -> np.ndarray:
        """Rest at the operating point of S1 3.5.1."""
        p_b = self.p_s / (1 + self.alpha)
        return np.array([0.0, 0.0, self.alpha * p_b, p_b, self.x_0, 0.0, 0.0])


def trajectory(machine: Machine, currents: Sequence[float], tick: float) -> np.ndarray:
    """Integrate with Radau at rtol 1e-10, the current held over each tick.

    Returns:
        The state after each tick, shape (ticks, 7).

    """
    scale = np.array([1e-2, 10.0, 1e7, 1e7, 0.1, 1.0, 1.0])
    y = machine.start()
    rows = []
    for current in currents:
        solved = solve_ivp(
            lambda _, z, i=current: np.array(machine.rates(z * scale, i)) / scale,
            (0.0, tick),
            y / scale,
            method="Radau",
            rtol=1e-10,
            atol=1e-12,
            t_eval=[tick],
        )
        assert solved.success, solved.message
        y = solved.y[:, -1] * scale
        rows.append(y)
    return np.array(rows)
