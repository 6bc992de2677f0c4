"""The hidden effects of a practice folder in a file that is not readable by accident."""

import base64
import json
import math
import textwrap
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.identify.experiment_design.practice import Ground, Hidden, hideable, knob_of
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.input_files import MIB
from hil_emulator.units import show

NAME = "truth.sealed"
_HEAD = "# The hidden effects. To open: hil-emulator hide --open FOLDER\n"


def seal(ground: Ground) -> str:
    """Return the text of the sealed file."""
    truth = {
        "configuration": ground.model.config.digest,
        "seed": ground.seed,
        "ordinary": ground.ordinary,
        "effects": [
            {"name": h.coordinate.name, "knob": knob_of(h.coordinate), "value": h.value,
             "unit": h.coordinate.unit}
            for h in ground.hidden
        ],
    }  # fmt: skip
    packed = base64.b64encode(zlib.compress(json.dumps(truth).encode(), 9)).decode()
    return _HEAD + "\n".join(textwrap.wrap(packed, 76)) + "\n"


def unseal(folder: Path) -> dict[str, Any]:
    """Return the hidden effects.

    Raises:
        UserError: if the file is missing or broken.

    """
    file = folder / NAME
    try:
        lines = input_files.read_text(file, input_files.SEALED).splitlines()
        packed = "".join(line for line in lines if not line.startswith("#"))
        content = zlib.decompressobj().decompress(base64.b64decode(packed, validate=True), MIB)
        return _checked(input_files.parse_json(content))
    except OSError as error:
        raise UserError(
            f"{file}: cannot be read: {error.strerror}; name a folder that `hide` has written"
        ) from None
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, zlib.error):
        raise UserError(f"{file}: is broken; hide the effects again") from None


def _checked(truth: Any) -> dict[str, Any]:
    """Return the content of a sealed file after a check of every entry.

    Raises:
        ValueError, TypeError, KeyError, AttributeError, OverflowError: an entry is wrong.

    """
    for effect in truth["effects"]:
        texts = [effect[key] for key in ("name", "knob", "unit")]
        if not all(isinstance(text, str) for text in texts) or not math.isfinite(effect["value"]):
            raise ValueError("an effect is damaged")
    ordinary = {str(name): float(value) for name, value in truth["ordinary"].items()}
    return {**truth, "ordinary": ordinary, "seed": int(truth["seed"])}


def restored(model: PlantModel, truth: Mapping[str, Any]) -> Ground:
    """Return the machine with hidden effects from a sealed file.

    Raises:
        UserError: if it belongs to another configuration, or does not fit this version.

    """
    if truth.get("configuration") != model.config.digest:
        raise UserError("the configuration has changed since the effects were hidden in it")
    available = hideable(model)
    unknown = {e["name"] for e in truth["effects"]} - available.keys()
    if unknown or {c.name for c in parameters.ordinary(model)} - truth["ordinary"].keys():
        raise UserError("what is hidden is damaged, or of another version; hide the effects again")
    hidden = tuple(Hidden(available[e["name"]], float(e["value"])) for e in truth["effects"])
    return Ground(model, hidden, dict(truth["ordinary"]), int(truth["seed"]))


def compared(truth: Mapping[str, Any], result: Mapping[str, Any]) -> list[str]:
    """Return a comparison of hidden and named effects, line by line."""
    named = {e["name"]: e for e in result["effects"]}
    lines, used = [], set()
    for hidden in truth["effects"]:
        name = hidden["name"]
        groups = [n for n, e in named.items() if name in e["group"]]
        if name in named:
            used.add(name)
            lines.append(f"named     {name}, {_value(hidden, named[name])}")
        elif groups:
            used.add(groups[0])
            lines.append(f"in group  {name} with {groups[0]}: these data do not separate them")
        else:
            lines.append(f"missed    {name}")
    lines += [f"wrong     {name} is named and not hidden" for name in named if name not in used]
    if not truth["effects"] and not named:
        lines.append("right     nothing is hidden, and nothing is named")
    return lines


def _value(hidden: Mapping[str, Any], named: Mapping[str, Any]) -> str:
    low, high = named["interval"]
    value, unit = hidden["value"], hidden["unit"]
    inside = "inside" if low <= value <= high else "outside"
    off = abs(named["value"] / value - 1.0) if value else math.inf
    return (
        f"{show(named['value'], unit)}, {100.0 * off:.1f} % off; the truth is {inside} its 95 % "
        f"interval {show(low, unit)} ... {show(high, unit)}"
    )
