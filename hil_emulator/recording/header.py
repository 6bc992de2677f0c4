"""The header of a recording: origin and meaning of the data."""

from collections.abc import Sequence
from typing import Any

from hil_emulator import __version__
from hil_emulator.config.effect_files import digests
from hil_emulator.config.load import Configuration
from hil_emulator.device.node import Node
from hil_emulator.recording.journal import Recording
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.recording.messages import as_json, messages, service_messages
from hil_emulator.signals.columns import columns


def provenance(config: Configuration) -> dict[str, str]:
    """Return the origin of a recording."""
    return {
        "hil-emulator": __version__,
        "configuration": ", ".join(f.name for f in config.files),
        "digest": config.digest,
        "seed": str(config.seed),
    }


def header(config: Configuration, nodes: Sequence[Node], capture: str = "") -> dict[str, Any]:
    """Return the header of a recording.

    Args:
        config: of the run.
        nodes: its nodes, for the meaning of the frames.
        capture: the condition of a pre-trigger capture, which does not begin at the start.

    """
    return {
        "provenance": provenance(config),
        "files": [str(f.resolve()) for f in config.files],
        "seed": config.seed,
        "nodes": [(n.id, n.bus_number) for n in config.nodes],
        "tick_ns": config.tick_ns,
        "capture": capture,
        "columns": columns(),
        "messages": as_json(messages(nodes)),
        "services": as_json(service_messages(nodes)),
        "configuration": list(config.texts),
        "effects": digests(config.effects),
        "sync_ms": config.sync_period_ns // 1_000_000,
        "supply_mates": list(config.supply_mates),
    }


def remembered(recorder: MemoryRecorder, head: dict[str, Any]) -> Recording:
    """Return the content of a memory recorder as a recording."""
    return Recording(head, recorder.rows(), list(recorder.frames), list(recorder.events))
