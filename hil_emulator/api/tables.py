"""Tables of signals with their units: pandas, and xarray if required."""

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hil_emulator.errors import UserError
from hil_emulator.signals.columns import columns

if TYPE_CHECKING:
    import pandas
    import xarray

TIME = "time"
UNITS = "units"
"""Key of the units by column in a table's `attrs`."""

SET_POINT_FIRST = "set_point_first"
"""Key that states whether a row's set point had acted before its readings were taken."""


def frame(values: Any, units: Mapping[str, str], **about: Any) -> "pandas.DataFrame":
    """Return signals over time as a table.

    Args:
        values: shape (rows, columns), SI; one column is the time.
        units: SI unit of each column by its name, in their order.
        about: further entries of `attrs`.

    Raises:
        UserError: if pandas is not installed.

    """
    table = _module("pandas").DataFrame(values, columns=list(units)).set_index(TIME)
    table.attrs.update({UNITS: dict(units), **about})
    made: pandas.DataFrame = table
    return made


def recorded(rows: Any, **about: Any) -> "pandas.DataFrame":
    """Return rows of a recording of this package as a table, shape (ticks, signals.columns)."""
    return frame(rows, columns(), **{SET_POINT_FIRST: True}, **about)


def to_xarray(table: "pandas.DataFrame") -> "xarray.Dataset":
    """Return a table of this package as a data set whose variables have their units.

    Raises:
        UserError: if xarray is not installed.

    """
    _module("xarray")
    made: Any = table.to_xarray()
    units = table.attrs.get(UNITS, {})
    for name in (TIME, *table.columns):
        made[name].attrs["units"] = units.get(name, "")
    made.attrs.update({key: value for key, value in table.attrs.items() if key != UNITS})
    dataset: xarray.Dataset = made
    return dataset


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise UserError(
            f"tables need {name}, which is not installed; pip install 'hil-emulator[notebook]'"
        ) from None
