"""SDO by hand: a stock `canopen` master whose frames pass through the loop."""

import asyncio
import struct
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoError

from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.protocol.operation import SdoRequest

Send = Callable[[int, bytes], None]
"""Sends a frame: COB-ID and data."""

_SDO_ANSWERS = range(0x581, 0x600)
"""COB-IDs from a default SDO server (CiA 301 7.3.5)."""
_REFUSALS = (SdoError, KeyError, ValueError, OverflowError, OSError, struct.error)
"""Errors of `canopen`: an abort, no answer, an unreadable EDS, a value out of range."""
_PATIENCE_S = 2.0  # for an answer, which comes through the ring (assumed)


class ByHand(canopen.Network):
    """A network whose bus is the panel's.

    Args:
        send: sends a frame.

    """

    def __init__(self, send: Send) -> None:
        super().__init__()
        self._send = send

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a frame."""
        self._send(can_id, bytes(data))


class ObjectsByHand:
    """Reads and writes objects of nodes.

    Args:
        send: sends a frame; called from another thread.
        sheets: EDS of each node.

    """

    def __init__(self, send: Send, sheets: Mapping[str, str]) -> None:
        self._network = ByHand(send)
        self._sheets = sheets
        self._busy = asyncio.Lock()

    def hear(self, frames: Iterable[tuple[int, bool, Frame]]) -> None:
        """Handle the answers of SDO servers; `canopen` fails at faulty frames of other services."""
        for now_ns, sent, frame in frames:
            if sent and frame.identifier in _SDO_ANSWERS:
                self._network.notify(frame.can_id, bytearray(frame.data), now_ns * 1e-9)

    async def access(self, request: SdoRequest) -> str:
        """Read an object, or write it if the request has a value; return it in words.

        Raises:
            UserError: with the reason of the node, or if the value does not fit the object.

        """
        async with self._busy:
            return await asyncio.to_thread(self._access, request)

    def _access(self, request: SdoRequest) -> str:
        try:
            node = self._node(request.node)
            if request.value is None:
                return _read(node, *request.place)
            return _write(node, *request.place, request.value)
        except _REFUSALS as error:
            reason = f"SDO: {error}"
        # Raised here, so that the traceback of `error` keeps no stream of `canopen` alive: one that
        # is collected closes itself with a request, which must not happen in the event loop.
        raise UserError(reason)

    def _node(self, number: int) -> Any:
        if number not in self._network:
            node = self._network.add_node(number, self._sheets.get(str(number)))
            node.sdo.RESPONSE_TIMEOUT = _PATIENCE_S
            node.sdo.MAX_RETRIES = 1  # attempts; 0 would repeat the request for ever
        return self._network[number]


def _read(node: Any, index: int, subindex: int) -> str:
    data = bytes(node.sdo.upload(index, subindex))
    variable = node.object_dictionary.get_variable(index, subindex)
    if variable is None:
        return f"{index:04X}:{subindex:02X} = {data.hex(' ')}"
    value = variable.decode_raw(data)
    shown = f"{value} (0x{value:X})" if isinstance(value, int) and value >= 0 else str(value)
    return f"{variable.qualname} = {shown}"


def _write(node: Any, index: int, subindex: int, text: str) -> str:
    variable = node.object_dictionary.get_variable(index, subindex)
    if variable is None:
        node.sdo.download(index, subindex, bytes.fromhex(text))
        return f"{index:04X}:{subindex:02X} written"
    number = variable.data_type in canopen.objectdictionary.datatypes.INTEGER_TYPES
    real = variable.data_type in canopen.objectdictionary.datatypes.FLOAT_TYPES
    value = int(text, 0) if number else float(text) if real else text
    node.sdo.download(index, subindex, variable.encode_raw(value))
    return f"{variable.qualname} written"
