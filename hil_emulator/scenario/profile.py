"""Courses of settings and set points, from CSV files."""

import warnings
from pathlib import Path

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.scenario.outcome import Curve
from hil_emulator.scenario.schema import SignalProfile
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS, shown


def read_profile(folder: Path, profile: SignalProfile) -> tuple[Curve, Curve]:
    """Return time [s] and value of a profile.

    Raises:
        UserError: if the file does not have two columns of numbers under a header, or exceeds the
            bounds of its signal.

    """
    file = folder / profile.file
    try:
        input_files.check(file, input_files.COURSE)
        with warnings.catch_warnings(action="ignore"):  # of a file without rows
            rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        times, values = rows.T
    except (OSError, ValueError) as error:
        raise UserError(
            f"{file}: not a profile: {error}; it has a header and the columns time [s] and value"
        ) from None
    param = (SETTINGS | SET_POINTS)[profile.signal]
    bounded = param.allows(values.min()) and param.allows(values.max())
    if not (bounded and np.isfinite(times).all()):
        low, high = (shown(param, v) for v in (param.low, param.high))
        raise UserError(f"{file}: {profile.signal} has to stay within {low} ... {high}")
    return times, values
