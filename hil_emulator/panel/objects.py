"""SDO by hand: a stock `canopen` master whose frames go by way of the loop."""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoError

from hil_emulator.frame import Frame

Say = Callable[[int, bytes], None]
"""Sends a frame: COB-ID and data."""

_PATIENCE_S = 2.0  # for an answer, which comes by way of the ring (assumed)


class ByHand(canopen.Network):
    """A network whose bus is the panel's.

    Args:
        say: sends a frame.

    """

    def __init__(self, say: Say) -> None:
        super().__init__()
        self._say = say

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a frame."""
        self._say(can_id, bytes(data))


class ObjectsByHand:
    """Reads and writes objects of nodes.

    Args:
        say: sends a frame; called from a thread of its own.
        sheets: EDS of each node.

    """

    def __init__(self, say: Say, sheets: Mapping[str, str]) -> None:
        self._network = ByHand(say)
        self._sheets = sheets
        self._busy = asyncio.Lock()

    def hear(self, frames: Iterable[tuple[int, bool, Frame]]) -> None:
        """Take what went over the bus, answers among it."""
        for now_ns, sent, frame in frames:
            if sent and not frame.extended:
                self._network.notify(frame.can_id, bytearray(frame.data), now_ns * 1e-9)

    async def access(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Read an object, or write it where the request has a value; return it in words."""
        async with self._busy:
            return await asyncio.to_thread(self._access, request)

    def _access(self, request: Mapping[str, Any]) -> dict[str, Any]:
        try:
            node = self._node(int(request["node"]))
            index, subindex = int(str(request["index"]), 16), int(str(request["subindex"]), 0)
            if "value" in request:
                return {"text": _write(node, index, subindex, str(request["value"]))}
            return {"text": _read(node, index, subindex)}
        except SdoError as error:
            return {"error": f"SDO: {error}"}
        except (KeyError, ValueError, OSError) as error:
            return {"error": f"SDO: {error}"}

    def _node(self, number: int) -> Any:
        if number not in self._network:
            if not 1 <= number <= 127:
                raise ValueError("a node-ID is 1 to 127")
            node = self._network.add_node(number, self._sheets.get(str(number)))
            node.sdo.RESPONSE_TIMEOUT = _PATIENCE_S
            node.sdo.MAX_RETRIES = 0
        return self._network[number]


def _read(node: Any, index: int, subindex: int) -> str:
    data = bytes(node.sdo.upload(index, subindex))
    known = node.object_dictionary.get_variable(index, subindex)
    if known is None:
        return f"{index:04X}:{subindex:02X} = {data.hex(' ')}"
    value = known.decode_raw(data)
    shown = f"{value} (0x{value:X})" if isinstance(value, int) and value >= 0 else str(value)
    return f"{known.qualname} = {shown}"


def _write(node: Any, index: int, subindex: int, text: str) -> str:
    known = node.object_dictionary.get_variable(index, subindex)
    if known is None:
        node.sdo.download(index, subindex, bytes.fromhex(text))
        return f"{index:04X}:{subindex:02X} written"
    number = known.data_type in canopen.objectdictionary.datatypes.INTEGER_TYPES
    real = known.data_type in canopen.objectdictionary.datatypes.FLOAT_TYPES
    value = int(text, 0) if number else float(text) if real else text
    node.sdo.download(index, subindex, known.encode_raw(value))
    return f"{known.qualname} written"
