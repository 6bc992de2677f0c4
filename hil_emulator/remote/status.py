"""The status in words and seconds, made of the loop's plain values by the process that asked."""

from collections.abc import Mapping
from typing import Any

from hil_emulator.faults.words import fault_words
from hil_emulator.protocol.rig import LONGEST_WORDS, MOST_FAILURES


def status_fields(plain: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of `protocol.rig.StatusAnswer`.

    Args:
        plain: what `rig_requests` hands over.

    """
    bus, timing = plain["bus"], plain["timing"]
    return {
        "time": plain["now_ns"] * 1e-9,
        "slipped": plain["slipped_ns"] * 1e-9,
        "bus_load": plain["bus_load"],
        "faults": [_fault(plain["now_ns"], *fault) for fault in plain["faults"]],
        "settings": plain["settings"],
        "nodes": [{"id": number, "state": state.lower()} for number, state in plain["nodes"]],
        "bus": bus and dict(zip(("received", "sent", "dropped"), bus, strict=True)),
        "timing": timing and dict(zip(("ticks", "late"), timing, strict=True)),
        "failures": [text[:LONGEST_WORDS] for text in plain["failures"][-MOST_FAILURES:]],
    }


def _fault(
    now_ns: int, number: int, target: str, kind: str, parameters: Mapping[str, Any],
    began_ns: int | None, duration_ns: int | None,
) -> dict[str, Any]:  # fmt: skip
    left = None
    if duration_ns is not None:
        left = (duration_ns if began_ns is None else began_ns + duration_ns - now_ns) * 1e-9
    words = fault_words(target, kind, parameters)[:LONGEST_WORDS]
    return {"number": number, "fault": words, "began": began_ns is not None, "left": left}
