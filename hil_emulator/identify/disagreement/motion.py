"""The free run by region: standing, slow or fast, extending or retracting.

The borders follow the data: slow is below a third of a usual speed, standing below a tenth of that.
"""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.disagreement.gap import Compared, Gap, floor_of
from hil_emulator.identify.disagreement.residuals import shown_as
from hil_emulator.identify.measured.experiment import Array, Mask
from hil_emulator.identify.prediction.observer.predictor import Predictor

SLOW_BORDER = 1.0 / 3.0
"""Ratio of the upper border of slow motion and the 90 % quantile of the speed (assumed)."""

STANDING_BORDER = 1.0 / 30.0
"""Ratio of the upper border of standing and the 90 % quantile of the speed (assumed)."""


def by_motion(predictor: Predictor, compared: Compared, kind: str = "free") -> Gap:
    """Return the root mean square error by channel and region of motion.

    As in `gap.measure`, each number is in units of the noise, and in SI with the suffix `_rms`.

    Args:
        predictor: that has the names of channels and signals.
        compared: both models over the data; validation data are used if there are any.
        kind: "free" or "one_step".

    """
    part = "validation" if "validation" in compared.before else "training"
    old, new = compared.before[part], compared.after[part]
    column = predictor.model.signal_names.index("velocity")
    speeds = [v.replay.track[:, column] for v in new]
    usual = float(np.quantile(np.abs(np.concatenate(speeds)), 0.9))
    gap: Gap = {}
    for words, low, high in regions(usual):
        inside = [(s >= low) & (s < high) for s in speeds]
        for i, channel in enumerate(predictor.channels):
            errors = {when: [(getattr(v.replay, kind)[:, i], v.noise[i]) for v in views]
                      for when, views in (("before", old), ("after", new))}  # fmt: skip
            if all(v.floors is not None for v in new):
                errors["floor"] = [(floor_of(v, kind)[:, i], v.noise[i]) for v in new]
            entry: dict[str, float] = {}
            for when, parts in errors.items():
                entry[when] = _rms([error / noise for error, noise in parts], inside)
                entry[f"{when}_rms"] = _rms([error for error, _ in parts], inside)
            if np.isfinite(entry["before"]):
                gap.setdefault(channel, {})[words] = entry
    return gap


def regions(usual: float) -> list[tuple[str, float, float]]:
    """Return names and borders of the regions of motion for a usual speed [m/s]."""
    scale, unit = shown_as("m/s")
    written = [f"{border * usual * scale:.1g}" for border in (STANDING_BORDER, SLOW_BORDER)]
    still, slow = (float(level) / scale for level in written)
    return [
        (f"retracting, |v| > {scale * slow:g} {unit}", -np.inf, -slow),
        (f"retracting, |v| < {scale * slow:g} {unit}", -slow, -still),
        (f"standing, |v| < {scale * still:g} {unit}", -still, still),
        (f"extending, |v| < {scale * slow:g} {unit}", still, slow),
        (f"extending, |v| > {scale * slow:g} {unit}", slow, np.inf),
    ]


def _rms(errors: Sequence[Array], inside: Sequence[Mask]) -> float:
    chosen = np.concatenate([e[m] for e, m in zip(errors, inside, strict=True)])
    chosen = chosen[np.isfinite(chosen)]
    return float(np.sqrt(np.mean(chosen**2))) if len(chosen) else float("nan")
