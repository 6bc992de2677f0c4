"""The linear model of valve, cylinder and load (S1 eq. 3.21-3.40).

Three models of the same small motion, which can be compared:

    reduced    S1 eq. 3.38-3.40, with the sign of K_fh corrected
    complete   the same without eq. 3.29-3.32, which couple both pressures by a steady-state
               relation; exact for constant oil and sqrt-shaped edges
    exact      the Jacobians of the compiled model (`linearise`), every effect included

Eq. 3.29-3.32 hold in motion for v_a = alpha v_b, or if no flow depends on pressure
(K_ca = K_cb = 0). Otherwise the difference to the complete form is their error.

Signs as in `actuator`: q_b > 0 out of chamber b, hence K_cb <= 0.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import NDArray
from scipy import signal

from hil_emulator.model import actuator
from hil_emulator.model.linearise import Linearisation

Polynomial = NDArray[np.float64]


@dataclass(frozen=True)
class LinearisedMachine:
    """Parameters of the linear model; SI, symbols of S1 in brackets."""

    gain: float
    """Valve gain [K_v]."""
    underlap: float
    """Opening of every edge at null [u_0], underlap or clearance less overlap; S1 has zero lap."""
    supply_pressure: float
    tank_pressure: float
    area: float
    """Piston area [A_p]."""
    ratio: float
    """Annulus area over piston area [alpha]."""
    dead_volume_a: float
    dead_volume_b: float
    stroke: float
    bulk_modulus: float
    mass: float
    """Load and rod [M_l]."""
    friction: float
    """Viscous coefficient of the cylinder [B]."""
    load_friction: float
    """Viscous coefficient of the load [B_l]."""
    natural_frequency: float
    """Natural frequency of the spool [rad/s]."""
    damping_ratio: float
    edge_gains: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Gains of the edges s-a, a-t, s-b and b-t over the valve's; S1 has equal ones."""

    @classmethod
    def of(cls, values: Mapping[str, float]) -> "LinearisedMachine":
        """Create it from S1's parameters by field name, without other effects."""
        fields = ((f"{table}_{p.name}", p) for table, ps in actuator.PARAMS.items() for p in ps)
        values_by_name = {name: p.default for name, p in fields if p.default is not None} | dict(
            values
        )
        return cls(
            gain=values_by_name["valve_gain"],
            underlap=values_by_name.get("underlap_lap", 0.0)
            + values_by_name.get("land_leakage_clearance", 0.0)
            - values_by_name.get("overlap_lap", 0.0),
            supply_pressure=values_by_name["supply_pressure"],
            tank_pressure=values_by_name["tank_pressure"],
            area=values_by_name["cylinder_piston_area"],
            ratio=values_by_name["cylinder_area_ratio"],
            dead_volume_a=values_by_name["cylinder_dead_volume_a"],
            dead_volume_b=values_by_name["cylinder_dead_volume_b"],
            stroke=values_by_name["cylinder_stroke"],
            bulk_modulus=values_by_name["oil_bulk_modulus"],
            mass=values_by_name["load_mass"],
            friction=values_by_name.get("viscous_friction_coefficient", 0.0),
            load_friction=values_by_name.get("load_viscous_friction_coefficient", 0.0),
            natural_frequency=2.0 * math.pi * values_by_name["valve_natural_frequency"],
            damping_ratio=values_by_name["valve_damping_ratio"],
            edge_gains=_edge_gains(values_by_name),
        )

    @property
    def spool_pole(self) -> complex:
        """Pole of the spool, upper half plane [rad/s] (S1 eq. 3.4); real if overdamped."""
        d = complex(self.damping_ratio)
        return self.natural_frequency * (cmath.sqrt(d * d - 1.0) - d)

    def volumes(self, position: float) -> tuple[float, float]:
        """Return the volumes of both chambers [m³] (S1 eq. 3.13, 3.14)."""
        return (
            self.dead_volume_a + self.area * position,
            self.dead_volume_b + self.ratio * self.area * (self.stroke - position),
        )


def _edge_gains(values: Mapping[str, float]) -> tuple[float, float, float, float]:
    side = values.get("gain_asymmetry_asymmetry", 0.0)
    sa, at, sb, bt = (
        (1.0 + values.get(f"gain_{edge}_excess", 0.0)) * (1.0 + sense * side)
        for edge, sense in (("sa", 1.0), ("at", -1.0), ("sb", -1.0), ("bt", 1.0))
    )
    return sa, at, sb, bt


@dataclass(frozen=True)
class OperatingPoint:
    """Operating point: spool [A], position [m], pressures [Pa]."""

    spool: float
    position: float
    pressure_a: float
    pressure_b: float


def operating_point(
    machine: LinearisedMachine, spool: float, position: float, force: float = 0.0
) -> OperatingPoint:
    """Return the pressures of a steady motion against a hydraulic force [N].

    Steady motion makes q_b = alpha q_a, so alpha² times the drop at the edge of a equals the drop
    at the edge of b: with p_t = 0 and no force p_a = alpha³ p_s/(1 + alpha³) in extension and
    alpha p_s/(1 + alpha³) in retraction. At null S1's choice, p_a + p_b = p_s + p_t.
    """
    alpha, p_s, p_t = machine.ratio, machine.supply_pressure, machine.tank_pressure
    p_l = force / machine.area
    if spool == 0.0:
        p_b = (p_s + p_t - p_l) / (1.0 + alpha)
        return OperatingPoint(spool, position, p_s + p_t - p_b, p_b)
    source, sink = (p_s, p_t) if spool > 0.0 else (p_t, p_s)
    p_a = (p_l + alpha * sink + alpha**3 * source) / (1.0 + alpha**3)
    return OperatingPoint(spool, position, p_a, sink + alpha**2 * (source - p_a))


@dataclass(frozen=True)
class ValveCoefficients:
    """Linear flow through the valve: dq = k_q du_v - k_c dp for each chamber (S1 eq. 3.21-3.28)."""

    k_qa: float
    """Flow gain of chamber a [m³/(s A)]."""
    k_qb: float
    k_ca: float
    """Flow-pressure coefficient of chamber a [m³/(s Pa)], >= 0."""
    k_cb: float
    """Flow-pressure coefficient of chamber b, <= 0: a higher p_b drives more oil out."""

    @property
    def k_pa(self) -> float:
        """Pressure sensitivity K_qa/K_ca [Pa/A] (S1 eq. 3.27 without its spurious K_v)."""
        return self.k_qa / self.k_ca if self.k_ca else math.inf

    @property
    def k_pb(self) -> float:
        """Pressure sensitivity K_qb/K_cb [Pa/A] (S1 eq. 3.28 without its spurious K_v)."""
        return self.k_qb / self.k_cb if self.k_cb else -math.inf


def valve_coefficients(machine: LinearisedMachine, point: OperatingPoint) -> ValveCoefficients:
    """Differentiate the flow through the four edges (S1 eq. 3.9, 3.10, widened by underlap).

    At null with zero lap the flow has a kink: the coefficients are those of extension.
    """
    u, u_0, gain = point.spool, machine.underlap, machine.gain
    drops = (
        machine.supply_pressure - point.pressure_a, point.pressure_a - machine.tank_pressure,
        machine.supply_pressure - point.pressure_b, point.pressure_b - machine.tank_pressure,
    )  # fmt: skip
    if min(drops) <= 0.0:
        raise ValueError("the linear model needs both pressures between tank and supply pressure")
    root_sa, root_at, root_sb, root_bt = (math.sqrt(drop) for drop in drops)
    sa, at, sb, bt = machine.edge_gains
    opens, closes = max(0.0, u_0 + u), max(0.0, u_0 - u)
    extends = float(u > -u_0 or u == 0.0)
    retracts = float(u < u_0)
    return ValveCoefficients(
        k_qa=gain * (extends * sa * root_sa + retracts * at * root_at),
        k_qb=gain * (extends * bt * root_bt + retracts * sb * root_sb),
        k_ca=0.5 * gain * (sa * opens / root_sa + at * closes / root_at),
        k_cb=-0.5 * gain * (bt * opens / root_bt + sb * closes / root_sb),
    )


@dataclass(frozen=True)
class ForceCoefficients:
    """d(df_h)/dt = k_uv du_v + k_fh df_h + k_xp dx/dt (S1 eq. 3.33-3.37)."""

    k_uv: float
    """[N/(s A)]."""
    k_fh: float
    """[1/s], <= 0; S1 eq. 3.37 prints the opposite sign, which makes the model unstable."""
    k_xp: float
    """[N/m], the negative of the hydraulic stiffness."""


def force_coefficients(machine: LinearisedMachine, point: OperatingPoint) -> ForceCoefficients:
    """Return the coefficients of the linear force rate (S1 eq. 3.35-3.37)."""
    c = valve_coefficients(machine, point)
    v_a, v_b = machine.volumes(point.position)
    alpha, area, beta = machine.ratio, machine.area, machine.bulk_modulus
    return ForceCoefficients(
        k_uv=area * beta * (c.k_qa / v_a + alpha * c.k_qb / v_b),
        k_fh=-beta / (1.0 + alpha**3) * (c.k_ca / v_a - alpha**3 * c.k_cb / v_b),
        k_xp=-(area**2) * beta * (1.0 / v_a + alpha**2 / v_b),
    )


@dataclass(frozen=True)
class ForceResponse:
    """Transfer functions from the valve current [A] to two forces [N]."""

    hydraulic_force: signal.TransferFunction
    """df_h/du (S1 eq. 3.38)."""
    load_force: signal.TransferFunction
    """df/du (S1 eq. 3.40)."""


def _response(
    machine: LinearisedMachine, drive: Polynomial, motion: Polynomial, pressure: Polynomial
) -> ForceResponse:
    """Close pressure(s) f_h = drive(s) u_v - motion(s) v with load and spool; rising powers."""
    load = np.array([machine.load_friction, machine.mass])
    whole = np.array([machine.load_friction + machine.friction, machine.mass])
    w = machine.natural_frequency
    spool = np.array([w**2, 2.0 * machine.damping_ratio * w, 1.0]) / w**2
    below = poly.polymul(poly.polyadd(poly.polymul(pressure, whole), motion), spool)
    return ForceResponse(
        signal.TransferFunction(poly.polymul(drive, whole)[::-1], below[::-1]),
        signal.TransferFunction(poly.polymul(drive, load)[::-1], below[::-1]),
    )


def reduced(machine: LinearisedMachine, point: OperatingPoint) -> ForceResponse:
    """Return S1 eq. 3.38 and 3.40, with the spool of eq. 3.4."""
    k = force_coefficients(machine, point)
    return _response(
        machine, np.array([k.k_uv]), np.array([-k.k_xp]), np.array([-k.k_fh, 1.0])
    )  # fmt: skip


def complete(machine: LinearisedMachine, point: OperatingPoint) -> ForceResponse:
    """Return the same transfer functions with both pressures free (S1 eq. 3.11, 3.12, 3.21, 3.22).

    One pole more than `reduced`: the common mode of both pressures.
    """
    c = valve_coefficients(machine, point)
    v_a, v_b = machine.volumes(point.position)
    alpha, area, beta = machine.ratio, machine.area, machine.bulk_modulus
    mode_a = np.array([beta * c.k_ca / v_a, 1.0])
    mode_b = np.array([-beta * c.k_cb / v_b, 1.0])
    drive = area * beta * (c.k_qa / v_a * mode_b + alpha * c.k_qb / v_b * mode_a)
    motion = area**2 * beta * (mode_b / v_a + alpha**2 / v_b * mode_a)
    return _response(machine, drive, motion, poly.polymul(mode_a, mode_b))


def exact(linearisation: Linearisation, output: str) -> signal.ZerosPolesGain:
    """Return the transfer function from valve current to a signal of the linearised model.

    Unreachable or unobservable poles are kept, each with a zero. An example is the position if no
    balance depends on it: a pole and a zero at the origin.
    """
    zeros = linearisation.zeros("valve_current", output)
    poles = linearisation.poles
    s = 1j * 2.0 * float(np.max(np.abs(poles)))  # away from every pole and zero
    value = linearisation.response("valve_current", output, np.array([s.imag]))[0]
    gain = value * np.prod(s - poles) / np.prod(s - zeros)
    return signal.ZerosPolesGain(zeros, poles, float(gain.real))
