"""The EDS of a machine's node: that of the package, with limits and digits for the machine.

The EDS of the package is for a valve of 10 mA and pressures of up to 327 bar in 16 bits.
"""

import re

from hil_emulator.machines import sizing
from hil_emulator.machines.questions import Answers, valve

CURRENTS = ("2000", "2001")
"""Set point and safe set point of the valve's current, INTEGER32 in nA."""
PRESSURES = ("2010", "2011", "2012")
"""Both chambers and the supply, INTEGER16 in kPa."""
FORCE = "2030"
"""Load force, INTEGER32 in mN."""


def electronic_data_sheet(text: str, file_name: str, answers: Answers) -> str:
    """Return the text of a machine's EDS.

    Args:
        text: the package's EDS.
        file_name: name of the file.
        answers: of the user.

    """
    rated = valve(answers).get("rated_current")
    digit = _digit(1e-9, 2**31, rated)
    limit = round(rated / float(digit))
    for index in CURRENTS:
        text = _changed(text, index, "Factor", digit)
        text = _changed(text, index, "LowLimit", f"{-limit}")
        text = _changed(text, index, "HighLimit", f"{limit}")
    pressure, force = sizing.pressure_range(answers).value, sizing.force_range(answers).value
    for index in PRESSURES:
        text = _changed(text, index, "Factor", _digit(1e3, 2**15, 1.03 * pressure))
    text = _changed(text, FORCE, "Factor", _digit(1e-3, 2**31, force))
    return re.sub(r"(?m)^FileName=.*$", f"FileName={file_name}", text, count=1)


def _digit(fine: float, digits: int, reach: float) -> str:
    """Return the value of a digit: the fine value, or a multiple that covers the range.

    Args:
        fine: value of a digit in the package's EDS.
        digits: number of digits on each side of zero.
        reach: the largest value.

    """
    return f"{next(fine * n for n in (1, 2, 5, 10, 100, 1000) if fine * n * digits > reach):g}"


def _changed(text: str, index: str, key: str, value: str) -> str:
    """Return the text with another value of a key in the section of an object."""
    section = rf"(?ms)(^\[{index}\]$(?:(?!^\[).)*?^{key}=)[^\n]*$"
    return re.sub(section, rf"\g<1>{value}", text, count=1)
