"""The folder of an identification, read with checks of the required content."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator import input_files
from hil_emulator.errors import UserError, brief
from hil_emulator.identify.measured.formats import npz

RESULT, TRACES = "result.json", "traces.npz"
"""Files of a folder that `identify --out` writes."""

MODELS = {"configured": "before", "found": "after"}
"""Name of each model on the page, by the name of its errors in the file."""

SHORTEST, LONGEST = 1e-5, 1e3
"""Sample periods of a trace [s]: a log is examined at 1 ms to some seconds (assumed)."""

_LARGEST_WHOLE = 2**1000

Trace = dict[str, np.ndarray[Any, Any]]

_TEXTS = ("verdict", "reason", "gap_measure")
_EFFECT = {"name": str, "group": list, "value": float, "interval": list}


def result_of(file: Path) -> dict[str, Any]:
    """Return the content of a `result.json`.

    Raises:
        UserError: if it cannot be read or is damaged.

    """
    try:
        content = input_files.read_json(file, input_files.RESULT)
        _check(content)
    except (OSError, ValueError) as error:
        raise UserError(
            f"{file}: not the result of an identification: {_reason(error)}; write one with "
            "identify --out"
        ) from None
    return dict(content)


def traces_of(file: Path) -> dict[str, dict[str, Trace]]:
    """Return measurement and errors of both models: arrays by log, channel and part.

    The file holds arrays `LOG/CHANNEL|PART`, see `identify.disagreement.gap.traces`.

    Raises:
        UserError: if it cannot be read or is damaged.

    """
    try:
        logs: dict[str, dict[str, Trace]] = {}
        for key, values in npz.read(file, input_files.TRACES).items():
            name, _, part = key.rpartition("|")
            log, _, channel = name.rpartition("/")
            logs.setdefault(log, {}).setdefault(channel, {})[part] = values
        for log, channels in logs.items():
            _check_log(log, channels)
    except UserError:
        raise
    except Exception as error:  # numpy and zip raise many kinds of exception for damage
        raise UserError(
            f"{file}: not the traces of an identification: {_reason(error)}; write them with "
            "identify --out"
        ) from None
    return logs


def _reason(error: Exception) -> str:
    return brief(getattr(error, "strerror", None) or str(error) or type(error).__name__)


def _check(content: Any) -> None:
    """Raise ValueError if a result lacks required content."""
    if not isinstance(content, dict):
        raise ValueError("it is not a table of results")
    for name in _TEXTS:
        if not isinstance(content.get(name), str):
            raise ValueError(f"its {name} is missing")
    effects, gap = content.get("effects"), content.get("gap")
    if not isinstance(effects, list) or not all(map(_is_effect, effects)):
        raise ValueError("its effects are damaged")
    if not isinstance(gap, dict) or not all(
        isinstance(parts, dict) and all(isinstance(values, dict) for values in parts.values())
        for parts in gap.values()
    ):
        raise ValueError("its gap is damaged")


def _is_effect(effect: Any) -> bool:
    if not isinstance(effect, dict):
        return False
    kinds = [(effect.get(key), kind) for key, kind in _EFFECT.items()]
    if not all(_is_number(v) if kind is float else isinstance(v, kind) for v, kind in kinds):
        return False
    return len(effect["interval"]) == 2 and all(map(_is_number, effect["interval"]))


def _is_number(value: Any) -> bool:
    """Return whether a value is a number, infinity and NaN included, that a float can be."""
    return isinstance(value, float) or (isinstance(value, int) and abs(value) < _LARGEST_WHOLE)


def _check_log(log: str, channels: Mapping[str, Trace]) -> None:
    """Raise ValueError if the traces of a log do not fit together."""
    lengths = set()
    for channel, trace in channels.items():
        wanted = ["time", "measured", *MODELS.values(), *(f"free_{p}" for p in MODELS.values())]
        for part in wanted:
            values = trace.get(part)
            if values is None or values.ndim != 1 or values.dtype.kind != "f":
                raise ValueError(f"{log}/{channel} has no {part}")
            lengths.add(len(values))
    if len(lengths) != 1 or min(lengths) < 2:
        raise ValueError(f"{log} has arrays of {sorted(lengths)} samples")
    for trace in channels.values():
        if not SHORTEST <= float(trace["time"][1] - trace["time"][0]) <= LONGEST:
            raise ValueError(f"{log} has no clock")
