"""Where the exported files of a node are."""

from pathlib import Path

from hil_emulator.device.node import Node


def files(folder: Path, node: Node, ending: str) -> Path:
    """Return the exported file of a node."""
    (file,) = folder.glob(f"*_{node.node_id}.{ending}")
    return file
