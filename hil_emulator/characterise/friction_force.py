"""Friction from the sensors, and the coefficients of S1 eq. 3.18 from friction.

friction = A_p (p_a - alpha p_b) - f: pressure sensors minus load cell. Velocity: mean difference
of the position readings over a window (S2 eq. 9-10, with the factor 1/n_s that is missing in
print). It lags by half the window; the forces are taken from the middle of the same window.
"""

from dataclasses import dataclass

import numpy as np

from hil_emulator.characterise.result import Agreement, Column, Comparison, Series, column
from hil_emulator.characterise.size import fastest
from hil_emulator.characterise.stand import Bench, BenchRecord

_WINDOW = 10  # ticks: 10 ms at 1 kHz, as n_s = 1000 at 100 kHz in S2
TOP_SPEED = 0.3
"""Highest speed of both friction tests on the documents' machine [m/s]."""
_SLOWEST = 3e-3  # below this speed seals may stick [m/s] (assumed)
_STRIBECK = np.geomspace(4e-3, 0.1, 60)  # velocities C_s tried [m/s]


def speed_and_friction(bench: Bench, record: BenchRecord) -> tuple[Series, Series]:
    """Return velocity [m/s] and friction force [N] from readings."""
    area = bench.value("cylinder_piston_area")
    alpha = bench.value("cylinder_area_ratio")
    read = record.readings
    hydraulic = area * (read["pressure_a"] - alpha * read["pressure_b"])
    period = float(record.time[1] - record.time[0])
    x = read["position"]
    velocity = (x[_WINDOW:] - x[:-_WINDOW]) / (_WINDOW * period)
    half = _WINDOW // 2
    return velocity, (hydraulic - read["load_force"])[half:-half]


@dataclass(frozen=True)
class StribeckFit:
    """F = zero + B v + sign(v) (F_c0 + F_s0 exp(-|v|/C_s)) (S1 eq. 3.18)."""

    zero: float
    """Friction reading at standstill: offset of the sensors [N]."""
    viscous: float
    coulomb: float
    excess: float
    stribeck_velocity: float

    def __call__(self, velocity: Series) -> Series:
        """Return the friction force [N] without the offset of the sensors."""
        fading = self.excess * np.exp(-np.abs(velocity) / self.stribeck_velocity)
        return np.asarray(self.viscous * velocity + np.sign(velocity) * (self.coulomb + fading))


ILLUSTRATED = StribeckFit(0.0, 1000.0, 100.0, 100.0, 0.02)
"""The curve of S1 Fig. 3.8."""
DOCUMENT_FIT = StribeckFit(0.0, 1000.0, 100.0, 0.0, 0.02)
"""Values that S1 3.4.2 states for its Fig. 3.9."""


def _linear(v: Series, force: Series, c_s: float, excess: bool) -> tuple[Series, float]:
    """Fit all coefficients but C_s; return them and the squared error."""
    columns = [np.ones_like(v), v, np.sign(v)]
    if excess:
        columns.append(np.sign(v) * np.exp(-np.abs(v) / c_s))
    basis = np.column_stack(columns)
    coefficients = np.linalg.lstsq(basis, force, rcond=None)[0]
    return coefficients, float(np.sum((basis @ coefficients - force) ** 2))


def fit(velocity: Series, force: Series, excess: bool) -> StribeckFit:
    """Fit S1 eq. 3.18: linear least squares for each C_s of a grid.

    Args:
        velocity: [m/s], shape (n,); samples below 3 mm/s are left out.
        force: friction [N], shape (n,).
        excess: whether to fit a Stribeck excess.

    """
    moving = np.abs(velocity) > _SLOWEST
    v, f = velocity[moving], force[moving]
    tried = _STRIBECK if excess else _STRIBECK[:1]
    errors = [_linear(v, f, c_s, excess)[1] for c_s in tried]
    c_s = float(tried[int(np.argmin(errors))])
    coefficients, _ = _linear(v, f, c_s, excess)
    zero, viscous, coulomb, *rest = (float(c) for c in coefficients)
    return StribeckFit(zero, viscous, coulomb, rest[0] if rest else 0.0, c_s)


def comparisons(bench: Bench, fitted: StribeckFit) -> list[Comparison]:
    """Compare the fitted coefficients with the configured ones."""
    viscous = bench.value("viscous_friction_coefficient") * bench.relative_viscosity
    coulomb = bench.value("coulomb_friction_force")
    excess = bench.value("stribeck_friction_excess")
    # tolerance relative to the total friction: a slow machine shows little viscous friction
    hidden = coulomb / (viscous * min(TOP_SPEED, fastest(bench))) if viscous else 0.0
    rows = [
        ("viscous coefficient B", "N s/m", viscous, "configured; S1 3.4.2: 1000", fitted.viscous,
         0.03 * max(1.0, hidden)),
        ("Coulomb friction F_c0", "N", coulomb, "configured; S1 3.4.2: 100", fitted.coulomb, 0.03),
        ("Stribeck excess F_s0", "N", excess, "configured; S1 Fig. 3.8: 100", fitted.excess, 0.15),
    ]  # fmt: skip
    return [Comparison(*row, Agreement.CONFIGURED) for row in rows if row[2]]


def has_excess(bench: Bench) -> bool:
    """Return whether the machine's friction has a Stribeck excess, so that the fit needs it."""
    return bench.value("stribeck_friction_excess") > 0.0


def columns(velocity: Series, friction: Series, fitted: StribeckFit) -> dict[str, Column]:
    """Return the common table of both friction tests."""
    return {
        "velocity": column("m/s", velocity),
        "friction": column("N", friction - fitted.zero),
        "fit of S1 eq. 3.18": column("N", fitted(velocity)),
    }
